"""FMUs as plants: values, units, states and faults, against closed forms."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import twinrig
from children import interrupted
from fmus import COMPILER, LAG_2, LIBRARY_2, archive, lag, lag3
from twinrig import Output

pytestmark = pytest.mark.skipif(
    COMPILER is None and "CI" not in os.environ, reason="there is no C compiler"
)

PERIOD_S = 0.5

SCENARIO = """
duration = "1 s"

[controller]
kind = "constant"
period = "10 ms"

[plant]
model = "fmu"
file = "lag.fmu"
"""


class Constant:
    """Commands one metre from the first step on."""

    ports = (Output("u", "m"),)

    def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
        outputs[0] = 1.0


class Number(Constant):
    """Commands one."""

    ports = (Output("u", "1"),)


def scenario(folder: Path, more: str = "", **options: Any) -> Path:
    """Scenario of the lag, with its FMU."""
    lag(folder / "lag.fmu", **options)
    return written(folder, more)


def written(folder: Path, more: str = "") -> Path:
    path = folder / "lag.toml"
    path.write_text(SCENARIO + more)
    return path


def run(path: Path, controller: type = Constant, **options: Any) -> twinrig.Run:
    return twinrig.run(path, controllers={"constant": controller}, **options)


def program(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "twinrig", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


def lagged(times: Any) -> Any:
    return 1.0 - np.exp(-np.asarray(times) / PERIOD_S)


def test_lag_follows_its_closed_form_in_units_of_signals(folder: Path) -> None:
    # The FMU counts in millimetres.
    x = run(scenario(folder)).signals["x"]
    assert x.unit == "m"
    np.testing.assert_allclose(x, lagged(x.time), rtol=1e-12, atol=1e-15)


def test_own_process_and_this_process_give_the_same_bits(folder: Path) -> None:
    path = scenario(folder)
    fingerprints = {run(path, set={"plant.isolated": own}).fingerprint for own in (True, False)}
    assert len(fingerprints) == 1


def test_fmi_3_passes_events_and_vectors(folder: Path) -> None:
    for fault in ("NONE", "EARLY"):
        lag3(folder / "lag.fmu", fault)
        signals = run(written(folder), Number).signals
        x, events = signals["x"], signals["events"]
        np.testing.assert_allclose(x, lagged(x.time), rtol=1e-12, atol=1e-15)
        np.testing.assert_array_equal(signals["multiples"][:, 2], 3.0 * np.asarray(x))
        # An event every 0.1 s; those at instants of observation may be found one of them later.
        count = np.asarray(events.time) / 0.1
        assert np.all(np.asarray(events) <= np.floor(count + 1e-9))
        assert np.all(np.asarray(events) >= np.floor(count - 0.02 - 1e-9))


OFFSET = """
[plant.inputs]
"heat" = { variable = "u" }
[plant.outputs]
"temperature" = { variable = "x" }
"""


class Heat:
    """Commands zero degrees Celsius."""

    ports = (Output("heat", "K"),)

    def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
        outputs[0] = 273.15


def test_units_with_an_offset_are_converted_in_both_directions(folder: Path) -> None:
    celsius = LAG_2.replace('unit="mm"', 'unit="degC"')
    path = scenario(folder, OFFSET, description=celsius)
    temperature = run(path, Heat).signals["temperature"]
    assert temperature.unit == "K"
    # From 0 °C, towards 0 °C.
    np.testing.assert_allclose(temperature, 273.15, rtol=1e-15)


def test_parameters_are_set_before_the_start(folder: Path) -> None:
    x = run(scenario(folder, "[plant.parameters]\ngain = 2.5\n")).signals["x"]
    np.testing.assert_allclose(x, 2.5 * lagged(x.time), rtol=1e-12, atol=1e-15)


def test_steps_are_divided(folder: Path) -> None:
    path = scenario(folder)
    steps = [
        int(run(path, set={"plant.step": step}).signals["count"][-1]) for step in ("2 ms", "0.3 ms")
    ]
    # 500 observations in 1 s; the fewest equal parts of 2 ms up to 0.3 ms are 7.
    assert steps == [500, 3500]


FAULTS = {
    "CRASH": "its process was ended by SIGSEGV",
    "ABORT": "its process was ended by SIGABRT; its last output: a last word on standard error",
    "EXIT": "its process ended itself with exit code 3",
    "HANG": "a call took longer than 500.000 ms (`time_limit`)",
    "NOT_A_NUMBER": "lag/x failed at 498.000 ms",
    "INFINITE": "its value is -inf",
    "ERROR": "lag/fmi2DoStep failed at 500.000 ms",
    "FATAL": "it returned fatal",
    "DISCARD": "it discarded the step, which it simulated to 0.5 s",
    "PENDING": "it returned pending",
    "STATUS": "it returned the illegal status 17",
}


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_ends_the_run_with_a_readable_recording(folder: Path, fault: str) -> None:
    path = scenario(folder, 'time_limit = "500 ms"\n', fault=fault)
    recording = folder / "lag.mcap"
    with pytest.raises(twinrig.RunError) as raised:
        run(path, record=recording)
    assert FAULTS[fault] in str(raised.value)
    x = twinrig.read(recording).signals["x"]
    assert 0.49 < x.time[-1] < 0.51
    np.testing.assert_allclose(x, lagged(x.time), rtol=1e-12, atol=1e-15)


FAULTS_3 = {
    "STUCK": "it returned early 10000 times, at last at 0.5 s",
    "BACK": "it returned early at -0.5 s, outside of the step",
    "TERMINATE": "lag/fmi3DoStep failed at 500.000 ms",
    "TERMINATE_AT_EVENT": "the FMU ended the simulation",
    "ENDLESS": "its events do not end after 1000",
}


@pytest.mark.parametrize("fault", FAULTS_3)
def test_fault_of_fmi_3_ends_the_run(folder: Path, fault: str) -> None:
    lag3(folder / "lag.fmu", fault)
    with pytest.raises(twinrig.RunError) as raised:
        run(written(folder), Number)
    assert FAULTS_3[fault] in str(raised.value)


def test_messages_of_the_fmu_are_in_the_fault(folder: Path) -> None:
    path = scenario(folder, fault="ERROR")
    for own in (True, False):
        with pytest.raises(twinrig.RunError, match="error: the reason is 42"):
            run(path, set={"plant.isolated": own})


def test_output_of_an_fmu_disturbs_neither_protocol_nor_report(folder: Path) -> None:
    path = scenario(folder, fault="NOISE")
    path.write_text(SCENARIO.split("[controller]")[0] + "[plant]" + SCENARIO.split("[plant]")[1])
    done = program("run", "--json", "--no-record", "lag.toml", folder=folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["error"] is None


def test_library_that_cannot_be_loaded_here_leaves_the_current_folder(folder: Path) -> None:
    archive(folder / "lag.fmu", {"modelDescription.xml": LAG_2, LIBRARY_2: b"no library"})
    before = os.getcwd()
    with pytest.raises(twinrig.ScenarioError, match="its library cannot be loaded"):
        run(written(folder), set={"plant.isolated": False})
    assert os.getcwd() == before


def test_failure_at_the_end_leaves_the_results(folder: Path) -> None:
    assert run(scenario(folder, fault="CRASH_AT_END")).verdict == "pass"


@pytest.mark.parametrize("own", [True, False])
@pytest.mark.parametrize("version", [2, 3])
def test_saved_state_continues_with_the_same_bits(folder: Path, own: bool, version: int) -> None:
    if version == 2:
        path, controller = scenario(folder), Constant
    else:
        lag3(folder / "lag.fmu", "EARLY")
        path, controller = written(folder), Number
    options: Any = {"controllers": {"constant": controller}, "set": {"plant.isolated": own}}
    with twinrig.Rig(path, **options) as rig, twinrig.Rig(path, **options) as other:
        rig.step(until=0.305)
        saved = rig.save()
        rig.step(until=1.0)
        for again in (rig, other):
            expected = rig.read("x").tobytes()
            again.restore(saved)
            again.step(until=1.0)
            assert again.read("x").tobytes() == expected


def test_restoring_needs_the_capability(folder: Path) -> None:
    description = LAG_2.replace('canSerializeFMUstate="true"', "")
    path = scenario(folder, description=description)
    with twinrig.Rig(path, controllers={"constant": Constant}) as rig:
        state = rig.save()
        with pytest.raises(ValueError, match="the FMU `lag` .* lacks `canSerializeFMUstate`"):
            rig.restore(state)


def test_recording_is_replayed_without_the_file(folder: Path) -> None:
    path = scenario(folder)
    path.write_text(SCENARIO.split("[controller]")[0] + "[plant]" + SCENARIO.split("[plant]")[1])
    assert program("run", "lag.toml", folder=folder).returncode == 0
    (folder / "lag.fmu").unlink()
    (recording,) = (folder / "recordings").iterdir()
    done = program("replay", str(recording), folder=folder)
    assert done.returncode == 0 and "identical" in done.stdout


def test_mistakes_are_reported_at_their_places(folder: Path) -> None:
    more = """
[plant.inputs]
"a" = { variable = "uu" }
"b" = { variable = "x" }
[plant.outputs]
"c" = { variable = "title" }
"d" = { variable = "x", unit = "N" }
"e f" = { variable = "x" }
"body/position" = { variable = "x" }
[plant.parameters]
gian = 2
"""
    with pytest.raises(twinrig.ScenarioError) as raised:
        run(scenario(folder, more))
    found = [(problem.message, problem.help) for problem in raised.value.problems]
    assert found == [
        ("the FMU has no variable `uu`", "did you mean `u`?"),
        ("`x` is no input of the FMU: it is output", "inputs of the FMU: u, gain"),
        ("`title` is of type String", "signals are numbers"),
        ("`d` is in N, and the variable `x` in mm", "leave `unit` out"),
        (
            "`e f` is not the name of a signal",
            "names consist of letters, digits, `_`, `-` and `.`, separated by slashes",
        ),
        (
            "the standard signal body/position [m] × 3 has 1 elements here, in m",
            "give the variables another signal in [plant.outputs]",
        ),
        ("the FMU has no variable `gian`", "did you mean `gain`?"),
    ]


def test_signal_in_another_unit_is_a_near_miss(folder: Path) -> None:
    with pytest.raises(twinrig.ScenarioError, match=r"u \[1\]") as raised:
        run(scenario(folder), Number)
    assert "u [m]" in str(raised.value)


def test_fixed_step_requires_a_grid(folder: Path) -> None:
    variable = 'canHandleVariableCommunicationStepSize="true"'
    path = scenario(folder, description=LAG_2.replace(variable, ""))
    with pytest.raises(twinrig.ScenarioError, match='grid = "10.000 ms"'):
        run(path)
    more = 'coupling = { grid = "10 ms" }\n[observe]\nperiod = "10 ms"\n'
    path.write_text(path.read_text() + more)
    assert int(run(path).signals["count"][-1]) == 100


def workers() -> set[int]:
    """Processes that serve FMUs."""
    found = set()
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if b"twinrig._fmu" in (process / "cmdline").read_bytes():
                found.add(int(process.name))
        except OSError:
            pass  # It has ended meanwhile.
    return found


HANGING = """
import sys, twinrig
from test_fmu import Constant
print("ready", flush=True)
try:
    if sys.argv[2] == "run":
        twinrig.run(sys.argv[1], controllers={"constant": Constant})
    else:
        twinrig.Rig(sys.argv[1], controllers={"constant": Constant}).step(until=1.0)
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.parametrize("way", ["run", "step"])
def test_interrupt_ends_a_hanging_call(
    folder: Path, way: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    paths = [str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(paths))
    path = scenario(folder, 'time_limit = "60 s"\n', fault="HANG")
    began = time.monotonic()
    out, _ = interrupted(HANGING, str(path), way, after=3.0)
    assert out == "interrupted\n"
    assert time.monotonic() - began < 30.0


def test_worker_ends_with_a_parent_that_is_killed(folder: Path) -> None:
    temporary = folder / "temporary"
    temporary.mkdir()
    path = scenario(folder, 'time_limit = "60 s"\n', fault="HANG", at=0.0)
    path.write_text(SCENARIO.split("[controller]")[0] + "[plant]" + SCENARIO.split("[plant]")[1])
    before = workers()
    words = [sys.executable, "-m", "twinrig", "run", "--no-record", "lag.toml"]
    environment = {**os.environ, "TMPDIR": str(temporary)}
    with subprocess.Popen(words, cwd=folder, env=environment) as process:
        deadline = time.monotonic() + 20.0
        while not list(temporary.glob("*/fmu")) and time.monotonic() < deadline:
            time.sleep(0.05)
        started = workers() - before
        assert started
        time.sleep(0.2)
        process.send_signal(signal.SIGKILL)
    while workers() & started and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not workers() & started
    assert list(temporary.iterdir()) == []


def test_coupling_error_of_held_commands_is_that_of_their_delay(folder: Path) -> None:
    description = LAG_2.replace(' unit="mm"', "")
    lag(folder / "lag.fmu", description=description)
    path = folder / "leg.toml"
    path.write_text(
        'duration = "200 ms"\n[plant]\nmodel = "fmu"\nfile = "lag.fmu"\nisolated = false\n'
        '[plant.inputs]\n"leg/LF/hip/command" = { variable = "u", unit = "rad" }\n'
        '[plant.outputs]\n"leg/LF/foot/position" = { variables = ["x", "x", "x"] }\n'
        '[controller]\nkind = "script"\nshape = "sine"\nperiod = "10 ms"\nfrequency = "2 Hz"\n'
        '[io]\ntransfer_time = "1.234 ms"\n'
    )
    done = program("study", "coupling", "leg.toml", "--json", folder=folder)
    rows = json.loads(done.stdout)["rows"]
    commands = twinrig.run(path).signals["leg/LF/hip/command"]
    samples = np.arange(1, 21) * 0.01
    exact = response(commands, 0.617e-3, None, samples)
    compared = {}
    for row in rows:
        if (row["method"], row["kind"]) == ("grid-held", "together"):
            step = row["step_s"]
            held = response(commands, 0.617e-3, step, samples)
            error = math.sqrt(3.0) * np.abs(held - exact).max()
            assert row["error_max_m"] == pytest.approx(error, rel=1e-6)
            compared[step] = row["error_max_m"]
    assert len(compared) == 8
    # First order: the error is the delay up to the next instant of the grid times a rate.
    assert 100.0 < compared[10e-3] / compared[0.05e-3] < 400.0


def response(commands: Any, delay: float, grid: float | None, samples: Any) -> Any:
    """Closed form of the lag under held commands, which act after a delay, on a grid if given."""
    at = np.asarray(commands.time) + delay
    if grid is not None:
        at = np.ceil(at / grid - 1e-9) * grid
    x, now, u = 0.0, 0.0, 0.0
    found = []
    changes = [*zip(at, np.asarray(commands).ravel(), strict=True), (math.inf, 0.0)]
    for sample in samples:
        while changes[0][0] <= sample + 1e-12:
            then, command = changes.pop(0)
            x, now, u = u + (x - u) * math.exp(-(then - now) / PERIOD_S), then, command
        x, now = u + (x - u) * math.exp(-(sample - now) / PERIOD_S), sample
        found.append(x)
    return np.array(found)


