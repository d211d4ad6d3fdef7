"""Broken FMUs are refused with file and reason, and write nothing."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import warnings
import zipfile
from pathlib import Path
from typing import Any

import pytest
from broken_fmus import broken
from fmus import COMPILER, LAG_2, LIBRARY_2, archive
from twinrig._fmu._worker import Request, Status, Worker

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


def test_directory_may_be_listed_twice_and_a_file_may_not(folder: Path) -> None:
    path = folder / "model.fmu"
    contents: dict[str, str | bytes] = {"modelDescription.xml": LAG_2, LIBRARY_2: b"library"}
    for again, status in (("resources/", Status.DONE), (LIBRARY_2, Status.REFUSED)):
        archive(path, contents)
        with zipfile.ZipFile(path, "a") as file, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for _ in range(2):
                file.writestr(again, b"")
        found, reply = Worker(str(folder)).call(Request.DESCRIBE, b"")
        assert found == status, reply


def damaged(source: bytes, seed: int) -> bytes:
    """Bytes with a few of them changed, removed or inserted, most near the ends."""
    numbers, found = random.Random(seed), bytearray(source)
    for _ in range(numbers.randint(1, 4)):
        near_the_end = len(found) - 1 - numbers.randrange(300)
        place = numbers.choice([numbers.randrange(len(found)), numbers.randrange(300), near_the_end])
        way = numbers.randrange(3)
        if way == 0:
            found[place] = numbers.randrange(256)
        elif way == 1:
            del found[place : place + numbers.randint(1, 12)]
        else:
            found[place:place] = numbers.choices(b'<>&"/ 019-e', k=numbers.randint(1, 4))
    return bytes(found)


def test_damaged_archives_and_descriptions_are_described_or_refused(folder: Path) -> None:
    path = folder / "model.fmu"
    whole = archive(path, {"modelDescription.xml": LAG_2, LIBRARY_2: b"library"}).read_bytes()
    statuses = set()
    for seed in range(400):
        if seed % 2 == 0:
            path.write_bytes(damaged(whole, seed))
        else:
            description = damaged(LAG_2.encode(), seed)
            archive(path, {"modelDescription.xml": description, LIBRARY_2: b"library"})
        status, reply = Worker(str(folder)).call(Request.DESCRIBE, b"")
        statuses.add(status)
        assert reply
    assert statuses == {Status.DONE, Status.REFUSED}
