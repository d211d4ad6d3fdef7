"""Checks ci/touched: that its table has a place for every package and top folder, and what it says of
toy histories: of a change, a merge, a rebase, a shallow clone, a renamed folder, a deleted entry and
an edit of the table itself."""

import importlib.machinery
import importlib.util
import subprocess
import tempfile
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent


def load(name):
    loader = importlib.machinery.SourceFileLoader(name, str(HERE / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


touched = load("touched")


class Packages:
    """A workspace of three packages, of which each depends on the one before."""

    dependencies = {"low": set(), "middle": {"low"}, "high": {"middle"}}
    folders = {"low/": "low", "middle/": "middle", "high/": "high"}
    package = touched.Workspace.package
    closure = touched.Workspace.closure


TABLE = """
everything = ["Cargo.toml", "ci/sections."]
folders = { "docs/" = ["high"] }
section = [
    { name = "always", always = true },
    { name = "of-low", packages = ["low"] },
    { name = "of-high", packages = ["high"], paths = ["scripts/"] },
]
"""


class History:
    """A repository with a file in each folder, at whose first commit all sections have passed."""

    def __init__(self, folder):
        self.root = Path(folder)
        self.git("init", "--quiet", "--initial-branch=main")
        for name in ("low", "middle", "high", "docs", "scripts", "ci"):
            self.write(f"{name}/file", name)
        self.write("ci/sections.toml", TABLE)
        self.commit()
        first = self.git("rev-parse", "HEAD")
        self.passed = {name: {"commit": first} for name in ("of-low", "of-high", "tests")}

    def git(self, *words):
        settings = ["-c", "user.name=tester", "-c", "user.email=tester@example.org"]
        command = ["git", *settings, *words]
        done = subprocess.run(command, cwd=self.root, check=True, capture_output=True, text=True)
        return done.stdout.strip()

    def write(self, path, text):
        (self.root / path).parent.mkdir(parents=True, exist_ok=True)
        (self.root / path).write_text(text)

    def commit(self):
        self.git("add", "--all")
        self.git("commit", "--quiet", "--message=change")

    def change(self, *paths):
        for path in paths:
            self.write(path, "changed")
        self.commit()

    def touched(self, root=None):
        """The sections to run."""
        sections = touched.Sections(tomllib.loads(TABLE), Packages())
        names = ("always", "of-low", "of-high")
        reason = touched.reason
        return [name for name in names if reason(sections, self.passed, name, root or self.root)]

    def untouched_packages(self):
        sections = touched.Sections(tomllib.loads(TABLE), Packages())
        return touched.untouched_packages(sections, self.passed, self.root)


ALL = ["always", "of-low", "of-high"]


def nothing_has_changed(history):
    assert history.touched() == ["always"]
    assert history.untouched_packages() == ["high", "low", "middle"]


def change_reaches_what_depends_on_it(history):
    history.change("middle/file")
    assert history.touched() == ["always", "of-high"]
    assert history.untouched_packages() == ["low"]
    history.change("low/file")
    assert history.touched() == ALL
    assert history.untouched_packages() == []


def uncommitted_change_counts(history):
    history.write("low/new", "new")
    assert history.touched() == ALL


def paths_and_folders_of_the_table_count(history):
    history.change("docs/file")
    assert history.touched() == ["always", "of-high"]
    assert history.untouched_packages() == ["low", "middle"]


def scripts_of_a_section_touch_it_alone(history):
    history.change("scripts/file")
    assert history.touched() == ["always", "of-high"]
    assert history.untouched_packages() == ["high", "low", "middle"]


def unknown_path_touches_all(history):
    history.change("elsewhere")
    assert history.touched() == ALL
    assert history.untouched_packages() == []


def edit_of_the_table_touches_all(history):
    history.change("ci/sections.toml")
    assert history.touched() == ALL


def renamed_folder_touches_both(history):
    history.git("mv", "low", "other")
    history.commit()
    assert history.touched() == ALL


def deleted_file_counts(history):
    history.git("rm", "--quiet", "middle/file")
    history.commit()
    assert history.touched() == ["always", "of-high"]


def merge_brings_the_changes_of_both_sides(history):
    history.git("switch", "--quiet", "--create=side")
    history.change("high/file")
    history.git("switch", "--quiet", "main")
    history.change("scripts/file")
    history.git("merge", "--quiet", "--no-edit", "side")
    assert history.touched() == ["always", "of-high"]
    # A section that passed on the side has not seen the other one.
    history.passed["of-high"] = {"commit": history.git("rev-parse", "side")}
    assert history.touched() == ["always", "of-high"]


def rebased_commit_is_no_ancestor(history):
    history.change("high/file")
    history.passed["of-low"] = {"commit": history.git("rev-parse", "HEAD")}
    assert "of-low" not in history.touched()
    history.git("commit", "--quiet", "--amend", "--message=other")
    assert "of-low" in history.touched()


def shallow_clone_runs_all(history):
    history.change("docs/file")
    with tempfile.TemporaryDirectory() as folder:
        history.git("clone", "--quiet", "--depth=1", f"file://{history.root}", folder)
        assert history.touched(Path(folder)) == ALL


def folder_without_git_runs_all(history):
    with tempfile.TemporaryDirectory() as folder:
        assert history.touched(Path(folder)) == ALL


def deleted_entry_runs(history):
    del history.passed["of-low"]
    assert history.touched() == ["always", "of-low"]


def table_has_a_place_for_everything():
    table = tomllib.loads((HERE / "sections.toml").read_text())
    workspace = touched.Workspace()
    sections = touched.Sections(table, workspace)
    names = {name for one in table["section"] for name in one.get("packages", [])}
    names |= {name for found in table["folders"].values() for name in found}
    assert names <= set(workspace.dependencies), names - set(workspace.dependencies)
    files = subprocess.run(["git", "ls-files"], cwd=HERE.parent, capture_output=True, text=True)
    named = table["everything"] + [path for one in table["section"] for path in one.get("paths", [])]
    for path in files.stdout.splitlines():
        known = any(path.startswith(prefix) for prefix in named)
        assert known or sections.packages(path), path
    functions = (HERE / "sections.bash").read_text()
    for name in sections.sections:
        assert f"\n{name}() {{" in functions, f"{name}: no such function"


def main():
    checks = [check for check in globals().values() if getattr(check, "__code__", None)]
    toys = [check for check in checks if check.__code__.co_varnames[:1] == ("history",)]
    for check in toys:
        with tempfile.TemporaryDirectory() as folder:
            check(History(folder))
    table_has_a_place_for_everything()
    print(f"{len(toys) + 1} passed, 0 failed")


main()
