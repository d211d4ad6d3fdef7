"""Scenario files as tests of pytest."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import weakref
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pytest
import twinrig

pytest_plugins = ["pytester"]

ROOT = Path(__file__).resolve().parents[3]

HEAD = f"""
robot = "{ROOT}/robots/cheetah-cub.toml"
duration = "1 s"
[plant]
model = "massless"
ground = {{ friction = 0.6 }}
[controller]
kind = "stand"
period = "2 ms"
hip_height = "130 mm"
"""

HOLDS = """
[[expect]]
name = "does not fall"
body = { fall = false }
"""

FAILS = """
[[expect]]
name = "walks"
body = { speed = { min = "1 m/s" } }
"""

UNOBSERVED = """
[[expect]]
name = "trots"
footstep = { phase = "trot", tolerance = 0.05 }
"""


@pytest.fixture(autouse=True)
def _without_other_plug_ins(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without files of pytest and plug-ins of this machine.

    A `setup.py` in a folder above would be the root of the paths and of the tests.
    """
    pytester.makeini("[pytest]")
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")


def run(pytester: pytest.Pytester, *arguments: str | os.PathLike[str]) -> pytest.RunResult:
    """Run pytest in this process, with the plug-in whether or not it is installed."""
    return pytester.runpytest_inprocess("-p", "pytest_twinrig", *arguments)


def write(pytester: pytest.Pytester, *expectations: str, name: str = "stand.toml") -> Path:
    """Write a scenario."""
    path = pytester.path / name
    path.write_text(HEAD + "".join(expectations), encoding="utf-8")
    return path


def test_an_expectation_is_a_test_with_the_outcome_of_the_program(
    pytester: pytest.Pytester,
) -> None:
    optional = UNOBSERVED.replace('"trots"', '"trots, perhaps"\noptional = true')
    write(pytester, HOLDS, FAILS, UNOBSERVED, optional)
    result = run(pytester, "-v")
    result.assert_outcomes(passed=1, failed=2, skipped=1)
    judged = {one.name: one for one in twinrig.run("stand.toml").expectations}
    assert [one.verdict for one in judged.values()] == ["pass", "fail", "unobserved", "unobserved"]
    result.stdout.fnmatch_lines(
        [
            "stand.toml::does not fall PASSED*",
            "stand.toml::walks FAILED*",
            "stand.toml::trots FAILED*",
            "stand.toml::trots, perhaps SKIPPED*",
        ]
    )


@pytest.mark.parametrize("worker", [None, "gw0"], ids=["alone", "worker"])
def test_a_failure_shows_table_and_command_and_no_traceback(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, worker: str | None
) -> None:
    if worker:  # As pytest-xdist does.
        monkeypatch.setenv("PYTEST_XDIST_WORKER", worker)
    write(pytester, HOLDS, FAILS)
    result = run(pytester, "--twin-set", "controller.hip_height=125 mm", "--twin-record", "kept")
    result.stdout.fnmatch_lines(
        [
            "fail, measured * m/s, bound 1 m/s, margin *",
            "*✓  does not fall *",
            "*✗  walks *",
            "*FAIL  1 of 2 expectations hold*",
            "  recording    kept/stand-seed1-*.mcap",
            "repeat: twin run stand.toml --set 'controller.hip_height=125 mm'",
            "recording: kept/stand-seed1-*.mcap",
            "FAILED stand.toml::walks - fail, measured*",
        ]
    )
    assert "Traceback" not in result.stdout.str() and "items.py" not in result.stdout.str()
    (recording,) = (pytester.path / "kept").iterdir()
    assert twinrig.read(recording).verdict == "fail"


def test_scenarios_run_once_and_only_for_the_tests_that_are_selected(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(pytester, HOLDS, FAILS)
    write(pytester, HOLDS, name="other.toml")
    started = []
    original = twinrig.run

    def counted(scenario: twinrig._scenario.Scenario, **rest: object) -> twinrig.Run:
        started.append(str(scenario))
        return original(scenario, **rest)  # type: ignore[arg-type]

    monkeypatch.setattr(twinrig, "run", counted)
    run(pytester, "--collect-only").assert_outcomes()
    assert started == []
    run(pytester, "-k", "walks").assert_outcomes(failed=1, deselected=2)
    assert started == ["stand.toml"]
    run(pytester).assert_outcomes(passed=2, failed=1)
    assert sorted(started[1:]) == ["other.toml", "stand.toml"]
    run(pytester, "stand.toml::does not fall").assert_outcomes(passed=1)
    assert started[3:] == ["stand.toml"]


def test_each_plant_has_its_tests(pytester: pytest.Pytester) -> None:
    of_lcp = HOLDS.replace('"does not fall"', '"of lcp"\nplants = ["lcp"]')
    write(pytester, HOLDS, of_lcp)
    pytester.makeini("[pytest]\ntwin_plant = massless lcp\n")
    result = run(pytester, "-v")
    result.assert_outcomes(passed=3)
    result.stdout.fnmatch_lines(
        [
            "stand.toml::does not fall[[]massless[]] PASSED*",
            "stand.toml::does not fall[[]lcp[]] PASSED*",
            "stand.toml::of lcp[[]lcp[]] PASSED*",
        ]
    )
    run(pytester, "--twin-plant", "lcp", "stand.toml::of lcp").assert_outcomes(passed=1)


def test_a_scenario_without_expectations_has_the_test_runs(pytester: pytest.Pytester) -> None:
    write(pytester)
    result = run(pytester, "-v")
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["stand.toml::runs PASSED*"])


@pytest.mark.parametrize(
    ("change", "message", "place"),
    [
        (("hip_height", "hip_heigth"), "*unknown key `hip_heigth`*", "*> stand.toml:10:1"),
        (("[controller]", "[controller"), "*error: *", "*> stand.toml:7:*"),
    ],
    ids=["key", "syntax"],
)
def test_a_broken_scenario_is_an_error_with_place_and_caret(
    pytester: pytest.Pytester, change: tuple[str, str], message: str, place: str
) -> None:
    path = write(pytester, HOLDS)
    path.write_text(path.read_text(encoding="utf-8").replace(*change), encoding="utf-8")
    result = run(pytester)
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["*ERROR collecting stand.toml*", message, place, "*^*"])
    assert "items.py" not in result.stdout.str()


def test_a_run_without_an_answer_is_an_error_of_every_test(pytester: pytest.Pytester) -> None:
    write(pytester, HOLDS, FAILS)
    # No step is short enough for this tolerance.
    result = run(pytester, "--twin-set", "plant.tolerance=1e-16 m")
    result.assert_outcomes(errors=2)
    result.stdout.fnmatch_lines(["*error: integrator failed*", "repeat: twin run stand.toml *"])
    assert "items.py" not in result.stdout.str()


def test_warnings_have_their_place_and_can_be_errors(pytester: pytest.Pytester) -> None:
    write(pytester, HOLDS)
    slow = "--twin-set=controller.compute_time=3 ms"
    result = run(pytester, slow)
    result.assert_outcomes(passed=1, warnings=1)
    result.stdout.fnmatch_lines(["*ScenarioWarning: warning*computing takes 3 ms*"])
    result = run(pytester, slow, "-W", "error::twinrig.ScenarioWarning")
    result.assert_outcomes(errors=1)


def test_junit_has_the_expectations(pytester: pytest.Pytester) -> None:
    write(pytester, HOLDS, FAILS)
    run(pytester, "--junitxml=report.xml")
    cases = ElementTree.parse(pytester.path / "report.xml").iter("testcase")
    outcomes = {case.get("name"): case for case in cases}
    assert list(outcomes) == ["does not fall", "walks"]
    assert outcomes["does not fall"].find("failure") is None
    failure = outcomes["walks"].find("failure")
    assert failure is not None and "FAIL  1 of 2 expectations hold" in (failure.text or "")
    properties = {one.get("name"): one.get("value") for one in outcomes["walks"].iter("property")}
    assert properties["fingerprint"] == twinrig.run("stand.toml").fingerprint
    assert float(properties["margin"] or 0) < 0


def test_other_toml_files_and_other_tests_are_left_alone(pytester: pytest.Pytester) -> None:
    (pytester.path / "pyproject.toml").write_text("[project]\nname = 'x'\n", encoding="utf-8")
    (pytester.path / "broken.toml").write_text("[plant\n", encoding="utf-8")
    garden = "[plant]\nname = 'fern'\nduration = 2\n"
    (pytester.path / "garden.toml").write_text(garden, encoding="utf-8")
    pytester.makepyfile("def test_nothing(): pass")
    run(pytester).assert_outcomes(passed=1)


def test_pytest_without_scenarios_starts_without_the_module(pytester: pytest.Pytester) -> None:
    program = (
        "import pytest, sys\n"
        "pytest.main(['-p', 'pytest_twinrig', '-q'])\n"
        "sys.exit(any(name in sys.modules for name in ('twinrig', 'numpy')))\n"
    )
    pytester.makepyfile("def test_nothing(): pass")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    ended = subprocess.run([sys.executable, "-c", program], env=environment, check=False)
    assert ended.returncode == 0


def test_a_setting_without_a_value_is_refused(pytester: pytest.Pytester) -> None:
    write(pytester, HOLDS)
    result = run(pytester, "--twin-set", "duration")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*--twin-set duration: expected KEY=VALUE*"])


def test_the_installed_package_registers_the_plug_in(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD")
    write(pytester, HOLDS, FAILS)
    pytester.runpytest_subprocess().assert_outcomes(passed=1, failed=1)


def test_signals_of_runs_are_not_kept(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(pytester, HOLDS, FAILS)
    signals: list[weakref.ref[object]] = []
    original = twinrig.run

    def noted(*arguments: Any, **options: Any) -> twinrig.Run:
        run = original(*arguments, **options)
        signals.append(weakref.ref(run.signals))
        return run

    class Check:
        alive = -1

        def pytest_sessionfinish(self) -> None:
            gc.collect()
            self.alive = sum(one() is not None for one in signals)

    monkeypatch.setattr(twinrig, "run", noted)
    check = Check()
    pytester.inline_run("-p", "pytest_twinrig", plugins=[check]).assertoutcome(passed=1, failed=1)
    assert (len(signals), check.alive) == (1, 0)
