"""FMUs that misbehave: faults, output, interrupts and processes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import twinrig
from children import interrupted
from fmus import COMPILER, LAG_2, LAG_3, LIBRARY_2, archive, lag, lag3
from lags import SCENARIO, Constant, Number, lagged, program, run, scenario, written

pytestmark = pytest.mark.skipif(
    COMPILER is None and "CI" not in os.environ, reason="there is no C compiler"
)


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


BOUNDED = """
[[expect]]
name = "bounded"
signal = { name = "x", always = { max = 2.0 } }
[[expect]]
name = "later"
after = "600 ms"
signal = { name = "x", always = { max = 2.0 } }
"""


@pytest.mark.parametrize("own", [True, False])
@pytest.mark.parametrize("fault", ["TERMINATE", "TERMINATE_AT_EVENT", "2"])
def test_regular_end_by_the_fmu_needs_a_key(folder: Path, fault: str, own: bool) -> None:
    def text(key: str) -> Path:
        # The FMU of FMI 2.0 is in millimetres.
        return written(folder, key + (BOUNDED.replace("2.0", '"2 m"') if two else BOUNDED))

    two = fault == "2"
    if two:
        lag(folder / "lag.fmu", "TERMINATE")
    else:
        lag3(folder / "lag.fmu", fault)
    controller, isolated = Constant if two else Number, {"plant.isolated": own}
    with pytest.raises(twinrig.RunError, match="ended the simulation.*`may_terminate = true`"):
        run(text(""), controller, set=isolated)
    recording = folder / "ended.mcap"
    ended = run(text("may_terminate = true\n"), controller, set=isolated, record=recording)
    # What was seen is judged: nothing was after 0.6 s.
    verdicts = {row.name: row.verdict for row in ended.expectations}
    assert verdicts == {"bounded": "pass", "later": "unobserved"}
    assert ended.verdict == "fail" and 0.49 < ended.signals["x"].time[-1] < 0.51
    np.testing.assert_allclose(
        ended.signals["x"], lagged(ended.signals["x"].time), rtol=1e-12, atol=1e-15
    )
    assert twinrig.read(recording).signals["x"].shape == ended.signals["x"].shape


def test_messages_of_the_fmu_are_in_the_fault(folder: Path) -> None:
    path = scenario(folder, fault="ERROR")
    for own in (True, False):
        with pytest.raises(twinrig.RunError, match="error: the reason is 42"):
            run(path, set={"plant.isolated": own})
    token = 'instantiationToken="lag"'
    lag3(folder / "lag.fmu", description=LAG_3.replace(token, token.replace("lag", "other")))
    with pytest.raises(twinrig.ScenarioError, match="error: wrong token"):
        run(path, Number)


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
from lags import Constant
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
