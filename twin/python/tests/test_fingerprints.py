"""A run from Python is that of the program: the same fingerprint for all scenarios."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import twinrig
from conftest import ROOT

PROGRAM = Path(os.environ.get("TWIN", ROOT / "target/release/twin"))
SCENARIOS = sorted(
    str(path.relative_to(ROOT))
    for folder in ("scenarios", "scenarios/thesis")
    for path in (ROOT / folder).glob("*.toml")
)


def existing_program() -> str:
    """Return the program that cargo has built, which is not that of the package."""
    if not PROGRAM.exists():
        assert not os.environ.get("CI"), f"{PROGRAM} has not been built"
        pytest.skip(f"{PROGRAM} has not been built")
    return str(PROGRAM)


def program(*arguments: str) -> list[dict[str, Any]]:
    """Run a command of that program; return the objects that it prints."""
    words = [existing_program(), *arguments, "--json"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    return [json.loads(line) for line in done.stdout.splitlines()]


class Reports:
    """Reports of the program, which runs all scenarios while the tests run them, too."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.known: dict[str, dict[str, Any]] = {}

    def __getitem__(self, scenario: str) -> dict[str, Any]:
        assert self.process.stdout is not None
        while scenario not in self.known:
            report = json.loads(self.process.stdout.readline())
            self.known[report["file"]] = report
        return self.known[scenario]


@pytest.fixture(scope="session")
def reports() -> Iterator[Reports]:
    words = [existing_program(), "run", *SCENARIOS, "--no-record", "--json"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        yield Reports(process)
        process.kill()


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_run_equals_that_of_the_program(scenario: str, reports: Reports) -> None:
    report, expected = twinrig.run(scenario).report, reports[scenario]
    wall = ("wall_s", "real_time_factor")
    assert expected["fingerprint"]
    assert {key: report[key] for key in report if key not in wall} == {
        key: expected[key] for key in expected if key not in wall
    }


def test_settings_equal_those_of_the_command_line(folder: Path) -> None:
    arguments = ["--plant", "lcp", "--set", "duration=300 ms", "--set", "expect=[]"]
    arguments += ["--set", "seed=7", "--set", 'record.signals=["body/*"]', "--set", "plant.ground.friction=0.5"]
    (expected,) = program("run", "scenarios/trot.toml", *arguments, "--out", str(folder / "program"))
    run = twinrig.run(
        "scenarios/trot.toml",
        plant="lcp",
        set={"duration": "300 ms", "expect": [], "plant.ground.friction": 0.5},
        seed=7,
        signals=["body/*"],
        record=folder / "python",
    )
    assert run.fingerprint == expected["fingerprint"] and run.seed == 7
    assert run.recording is not None
    a = twinrig.read(run.recording)
    b = twinrig.read(str(expected["recording"]))
    assert list(a.signals) == list(b.signals) == list(run.signals)
    # Recordings keep keys and values of settings, in the order of application.
    assert sorted(json.loads(a.notes["settings"])) == sorted(json.loads(b.notes["settings"]))


def test_seed_is_that_of_all_random_streams() -> None:
    scenario = "scenarios/thesis/fig-4-8.toml"
    (expected,) = program("run", scenario, "--no-record", "--set", "seed=7")
    run = twinrig.run(scenario, seed=7)
    assert (run.fingerprint, run.seed) == (expected["fingerprint"], 7)
    assert run.fingerprint != twinrig.run(scenario).fingerprint


def test_a_dictionary_gives_the_run_of_its_file() -> None:
    tomllib = pytest.importorskip("tomllib", reason="Python 3.11 reads TOML")
    text = (ROOT / "scenarios/step-change.toml").read_text()
    tables = tomllib.loads(text)
    assert twinrig.run(tables).fingerprint == twinrig.run("scenarios/step-change.toml").fingerprint
    tables["duration"] = "11 s"
    assert (
        twinrig.run(tables).fingerprint
        == twinrig.run("scenarios/step-change.toml", set={"duration": "11 s"}).fingerprint
    )


def test_recording_in_a_folder_has_the_name_that_the_program_gives(folder: Path) -> None:
    cases: list[tuple[dict[str, Any], list[str]]] = [
        ({}, []),
        ({"plant": "lcp"}, ["--plant", "lcp"]),
        ({"set": {"duration": "250 ms"}}, ["--set", "duration=250 ms"]),
    ]
    for options, arguments in cases:
        base = ["run", "scenarios/leg-drop.toml", "--out", str(folder / "program")]
        (expected,) = program(*base, *arguments)
        run = twinrig.run("scenarios/leg-drop.toml", record=folder / "python", **options)
        assert run.recording is not None
        assert run.recording.name == Path(str(expected["recording"])).name
