"""Broken FMUs are refused with file and reason, and write nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from broken_fmus import broken
from fmus import COMPILER

pytestmark = pytest.mark.skipif(
    COMPILER is None and "CI" not in os.environ, reason="there is no C compiler"
)

SCENARIO = 'duration = "10 ms"\n[plant]\nmodel = "fmu"\nfile = "{name}.fmu"\n'


def tree(folder: Path) -> dict[str, bytes | None]:
    """Contents of a folder."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
    }


class Attempts:
    """Reports of all broken FMUs, from one call of each command."""

    def __init__(self, folder: Path) -> None:
        self.expected: dict[str, str] = {}
        for name, content, message in broken():
            self.expected[name] = message
            (folder / f"{name}.fmu").write_bytes(content)
            (folder / f"{name}.toml").write_text(SCENARIO.format(name=name))
        for empty in ("home", "temporary"):
            (folder / empty).mkdir()
        before = tree(folder)
        self.reports = {
            command: self._reports(folder, words)
            for command, words in (("check", ["check"]), ("run", ["run", "--no-record"]))
        }
        self.is_unchanged = tree(folder) == before

    def _reports(self, folder: Path, words: list[str]) -> dict[str, dict[str, Any]]:
        environment = {
            **os.environ,
            "HOME": str(folder / "home"),
            "TMPDIR": str(folder / "temporary"),
        }
        files = [f"{name}.toml" for name in self.expected]
        done = subprocess.run(
            [sys.executable, "-m", "twinrig", *words, "--json", *files],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 2
        assert "Traceback" not in done.stdout + done.stderr
        reports = [json.loads(line) for line in done.stdout.splitlines()]
        assert len(reports) == len(files)
        return dict(zip(self.expected, reports, strict=True))


@pytest.fixture(scope="module")
def attempts(tmp_path_factory: pytest.TempPathFactory) -> Attempts:
    return Attempts(tmp_path_factory.mktemp("broken"))


def test_thirty_broken_fmus_are_refused_with_file_and_reason(attempts: Attempts) -> None:
    assert len(attempts.expected) >= 30
    errors = [
        (command, name, report["error"] or "no error")
        for command, reports in attempts.reports.items()
        for name, report in reports.items()
    ]
    wrong = [
        (command, name, error)
        for command, name, error in errors
        if attempts.expected[name] not in error
        or f"{name}.toml" not in error
        or not (f"{name}.fmu" in error or f"the FMU `{name}`" in error)
    ]
    assert not wrong


def test_nothing_is_written_beside_the_temporary_folder(attempts: Attempts) -> None:
    assert attempts.is_unchanged
