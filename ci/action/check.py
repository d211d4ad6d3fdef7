"""Checks the action: by GitHub's schema, and by running its steps in an empty folder. The examples
of docs/tutorial-regression.md are checked by the schemas of GitHub and GitLab.

Usage: check.py PROGRAM [--build]

Steps that call other actions are left out, and without --build the one that builds the program: the
runs are those of PROGRAM.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from ruamel.yaml import YAML

ACTION = Path(__file__).with_name("action.yml")
PAGE = ACTION.parents[2] / "docs/tutorial-regression.md"

SCENARIO = """
robot = "cheetah-cub"
duration = "1 s"

[plant]
model = "massless"
ground = {}

[controller]
kind = "stand"
period = "2 ms"

[[expect]]
name = "stays above a height"
signal = { name = "body/position", component = "z", always = { min = "100 mm" } }
"""


# A board that is silent from an instant on, which ends the run before most of it is judged.
DEAD = """
robot = "oncilla"
duration = "2 s"

[plant]
model = "massless"
ground = {}

[actuator]
kind = "motor"

[[bus]]
kind = "sbcp"

[controller]
kind = "stand"
period = "2 ms"

[[fault]]
at = "700 ms"
on = "wire/sbcp/LF"
kind = "unplug"

[[expect]]
name = "does not fall"
body = { fall = false }

[[expect]]
name = "stays above a height"
signal = { name = "body/position", component = "z", always = { min = "100 mm" } }
"""


class Runner:
    """Runs the steps of the action as GitHub does, in a folder with two scenarios."""

    def __init__(self, folder, **inputs):
        self.folder = folder
        (folder / "tests").mkdir()
        (folder / "tests/one.toml").write_text(SCENARIO)
        (folder / "tests/two.toml").write_text(SCENARIO.replace("100 mm", "1 m"))
        (folder / "boards").mkdir()
        (folder / "boards/dead.toml").write_text(DEAD)
        self.action = YAML(typ="safe").load(ACTION.read_text())
        self.values = {
            f"inputs.{name}": entry.get("default", "")
            for name, entry in self.action["inputs"].items()
        }
        self.values |= {f"inputs.{name}": text for name, text in inputs.items()}
        self.values["github.action_path"] = str(ACTION.parent)
        self.summary = folder / "summary"
        self.text = ""

    def run(self, wanted):
        """Runs the scripts of the steps that have one of the conditions `wanted`."""
        code = 0
        for step in self.action["runs"]["steps"]:
            if code == 0 and "run" in step and step.get("if") in wanted:
                code = self.step(step)
        return code

    def step(self, step):
        output = self.folder / "output"
        output.write_text("")
        environment = {
            name: re.sub(r"\$\{\{ (.*?) \}\}", lambda found: self.values[found[1]], value)
            for name, value in step["env"].items()
        }
        environment |= {"GITHUB_OUTPUT": str(output), "GITHUB_STEP_SUMMARY": str(self.summary)}
        environment |= {"RUNNER_TEMP": str(self.folder / "temp")}
        environment |= {"RUNNER_OS": "Linux", "RUNNER_ARCH": "X64"}
        of_the_machine = ("PATH", "HOME", "RUSTUP_", "CARGO_")
        environment |= {
            name: value for name, value in os.environ.items() if name.startswith(of_the_machine)
        }
        script = self.folder / "step.sh"
        script.write_text(step["run"])
        shell = ["bash", "--noprofile", "--norc", "-eo", "pipefail", str(script)]
        done = subprocess.run(
            shell, cwd=self.folder, env=environment, capture_output=True, text=True, check=False
        )
        self.text += done.stdout + done.stderr
        for line in output.read_text().splitlines():
            name, value = line.split("=", 1)
            self.values[f"steps.{step['id']}.outputs.{name}"] = value
        return done.returncode


def check(expected, message, wanted=(None,), **inputs):
    """The steps end with an exit code, a message and, where scenarios ran, the files of the run."""
    with tempfile.TemporaryDirectory() as name:
        runner = Runner(Path(name), **inputs)
        code = runner.run(wanted)
        assert code == expected and message in runner.text, (inputs, code, runner.text)
        # A key of the cache must not have a comma.
        assert "," not in runner.values.get("steps.source.outputs.key", "")
        if message not in ("PASS", "FAIL"):
            return
        junit = Path(runner.values["steps.run.outputs.junit"])
        assert junit.read_text().count("<failure") == expected, junit.read_text()
        assert len(list(junit.parent.glob("recordings/*.mcap"))) == expected + 1
        assert message in runner.summary.read_text()
        annotation = "::error file=tests/two.toml,line=14::stays above a height: 0.14 m is not ≥"
        assert (annotation in runner.text) == bool(expected), runner.text
        # The page of the failure, and the command that repeats it.
        pages = [file.name for file in junit.parent.glob("recordings/*.html")]
        assert pages == ["two-seed1.html"] * expected, pages
        summary = runner.summary.read_text()
        assert ("- page: `recordings/two-seed1.html`" in summary) == bool(expected), summary
        assert ("- repeat: `twin run tests/two.toml" in summary) == bool(expected), summary
        assert ("![two-seed1.svg](data:image/svg+xml;base64," in summary) == bool(expected)


def check_error(program):
    """The cause of a run that ends by an error is annotated, and no expectation that it left
    unobserved."""
    with tempfile.TemporaryDirectory() as name:
        runner = Runner(Path(name), scenarios="boards/dead.toml", program=program)
        code = runner.run((None,))
        annotations = [it for it in runner.text.splitlines() if it.startswith("::error")]
        assert code == 2 and len(annotations) == 1, runner.text
        assert annotations[0].startswith("::error file=boards/dead.toml::"), annotations
        assert "board LF (id 1): silent" in annotations[0], annotations


def check_schema(name, file):
    """A file agrees with a schema that the package check-jsonschema has."""
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", f"vendor.{name}", file]
    subprocess.run(command, check=True)


def check_page():
    """Of the examples, the four lines are in the workflow, and workflow and job fit their schemas."""
    blocks = re.findall(r"^```yaml\n(.*?)^```", PAGE.read_text(), re.M | re.S)
    lines, workflow, job = blocks
    assert lines in workflow, lines
    with tempfile.TemporaryDirectory() as name:
        for schema, text in [("github-workflows", workflow), ("gitlab-ci", job)]:
            file = Path(name) / f"{schema}.yml"
            file.write_text(text)
            check_schema(schema, file)


def main():
    check_schema("github-actions", ACTION)
    check_page()
    program = str(Path(sys.argv[1]).resolve())
    check(0, "PASS", scenarios="tests/one.toml", program=program, options="--set seed=2")
    check(1, "FAIL", scenarios="tests/*.toml", program=program)
    check(1, "no match", scenarios="tests/three*.toml", program=program)
    check(2, "one.tml", scenarios="tests/one.tml", program=program)
    check_error(program)
    built = "inputs.program == ''"
    check(0, "", wanted=(built,), features="rapier,other")
    check(2, "builds no MuJoCo", wanted=(built,), features="rapier,mujoco")
    if "--build" in sys.argv:
        missing = f"{built} && steps.cache.outputs.cache-hit != 'true'"
        check(0, "PASS", wanted=(None, built, missing), scenarios="tests/one.toml")
    print("the steps of the action pass, fail and refuse")


main()
