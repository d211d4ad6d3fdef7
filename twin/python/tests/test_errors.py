"""Mistakes are exceptions with their place."""

from __future__ import annotations

import pickle
import warnings
from pathlib import Path
from typing import Any

import pytest
import twinrig

SMALL = {
    "robot": "cheetah-cub",
    "duration": "20 ms",
    "plant": {"model": "massless"},
    "controller": {"kind": "stand", "period": "2 ms"},
}


def test_mistake_in_a_dictionary_is_shown_with_its_place() -> None:
    with pytest.raises(twinrig.ScenarioError) as raised:
        twinrig.run({**SMALL, "controller": {"kind": "stand", "perod": "2 ms"}})
    error = raised.value
    assert '  |\n9 | perod = "2 ms"\n  | ^^^^^\n' in str(error)
    places = [(problem.file, problem.line, problem.column) for problem in error.problems]
    assert ("<scenario>", 9, 1) in places
    assert any("did you mean `period`" in problem.help for problem in error.problems)
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.problems) == (str(error), error.problems)


@pytest.mark.parametrize(
    ("options", "origin"),
    [
        ({"set": {"controller.perod": 3}}, "set="),
        ({"seed": -1}, "seed="),
        ({"plant": "masless"}, "plant="),
        ({"set": {"plant.step": float("nan")}}, "set="),
        ({"set": {"seed": 2**70}}, "set="),
    ],
)
def test_mistake_in_an_argument_names_the_argument(
    options: dict[str, object], origin: str
) -> None:
    for function in (twinrig.run, twinrig.plan):
        if function is twinrig.plan and "seed" in options:
            continue
        with pytest.raises(twinrig.ScenarioError) as raised:
            function(SMALL, **options)  # type: ignore[arg-type]
        assert raised.value.problems[0].file == origin


@pytest.mark.parametrize(
    "options",
    [
        {"set": {"plant.step": None}},
        {"set": {"plant.step": {1, 2}}},
        {"set": {1: 2}},
        {"set": "plant.step"},
        {"seed": 1.5},
        {"seed": True},
        {"plant": 3},
        {"signals": "leg/*"},
        {"signals": [3]},
        {"record": 3},
    ],
)
def test_wrong_types_are_type_errors(options: dict[str, object]) -> None:
    with pytest.raises(TypeError):
        twinrig.run(SMALL, **options)  # type: ignore[arg-type]


def test_values_without_an_encoding_or_an_end_are_value_errors() -> None:
    endless: list[object] = []
    endless.append(endless)
    for value in (endless, "\ud800"):
        with pytest.raises(ValueError):
            twinrig.run(SMALL, set={"plant.step": value})
    with pytest.raises(ValueError):
        twinrig.run("a\0b")


def test_check_reports_instead_of_raising() -> None:
    assert twinrig.check("scenarios/trot.toml")["valid"]
    wrong = twinrig.check({**SMALL, "duration": "2 m"})
    assert not wrong["valid"] and wrong["problems"][0].line == 2
    assert str(wrong["error"]).startswith("error: ")
    missing = twinrig.check("scenarios/no-such.toml")
    assert not missing["valid"] and missing["problems"][0].line is None


def test_warnings_are_warnings() -> None:
    slow = {**SMALL, "actuator": {"lag": "1 s"}}
    warned = twinrig.check(slow)
    assert warned["valid"] and [one["code"] for one in warned["warnings"]] == ["lag-beyond-run"]
    assert not twinrig.check(slow, strict=True)["valid"]
    with pytest.warns(twinrig.ScenarioWarning, match="longer than the run"):
        twinrig.run(slow)


def test_warning_that_a_filter_raises_loses_neither_run_nor_failure() -> None:
    slow: dict[str, Any] = {**SMALL, "actuator": {"lag": "1 s"}}
    # The devices of its bus need longer to open.
    late = [{"at": "1 s", "set": "frequency", "by": "0.1 Hz"}]
    broken: dict[str, Any] = {"duration": "10 ms", "expect": [], "change": late}
    with warnings.catch_warnings():
        warnings.simplefilter("error", twinrig.ScenarioWarning)
        with pytest.raises(twinrig.ScenarioWarning) as raised:
            twinrig.run(slow)
        with pytest.raises(twinrig.RunError) as failed:
            twinrig.run("scenarios/oncilla-trot.toml", set=broken)
    assert raised.value.run is not None and raised.value.run.report["simulated_s"] == 0.02
    assert failed.value.run.verdict == "error"


def test_signals_that_do_not_fit_into_memory_are_a_memory_error() -> None:
    with pytest.raises(MemoryError, match="signals="):
        twinrig.run(SMALL, set={"duration": "10000000 s", "observe.period": "1 ns"})


def test_recordings_that_cannot_be_read_or_written(folder: Path) -> None:
    for path in (folder, folder / "none.mcap", "pyproject.toml"):
        with pytest.raises(twinrig.RecordingError):
            twinrig.read(path)
    with pytest.raises(twinrig.TwinError):
        twinrig.run(SMALL, record="/proc/none/run.mcap")
    good = twinrig.run(SMALL, record=folder / "good.mcap").recording
    assert good is not None
    assert twinrig.diff(good, good)["identical"]
    with pytest.raises(twinrig.RecordingError):
        twinrig.diff(good, folder / "none.mcap")
    with pytest.raises(ValueError, match="--time"):
        twinrig.diff(good, good, events=True, time="5 kg")
    contents = good.read_bytes()
    (folder / "cut.mcap").write_bytes(contents[: len(contents) // 2])
    cut = twinrig.read(folder / "cut.mcap")
    assert not cut.is_complete and cut.is_interrupted and cut.signals


def test_run_that_fails_is_in_the_exception() -> None:
    """A bus whose devices need longer to open than the run lasts: control never starts."""
    with pytest.raises(twinrig.RunError, match="increase `duration`") as raised:
        twinrig.run("scenarios/oncilla-trot.toml", set={"duration": "10 ms", "expect": []})
    assert raised.value.run.verdict == "error" and raised.value.run.error
    assert len(raised.value.run.signals["body/position"]) > 1
    again = pickle.loads(pickle.dumps(raised.value))
    assert again.run.fingerprint == raised.value.run.fingerprint


def test_study_and_parts(folder: Path) -> None:
    study = twinrig.study(
        "stability",
        "scenarios/passive-legs.toml",
        plants=["massless"],
        duration="50 ms",
        budget=1,
        out=folder,
    )
    assert study["rows"] and list(folder.glob("*.html"))
    with pytest.raises(ValueError, match="invalid value"):
        twinrig.study("stability", budget=-1)
    with pytest.raises(ValueError, match="unrecognized subcommand"):
        twinrig.study("nonsense")
    assert "cheetah-cub" in twinrig.robots()
    assert {part["name"] for part in twinrig.parts()["plants"]} >= {"massless", "lcp"}
