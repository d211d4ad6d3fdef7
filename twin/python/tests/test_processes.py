"""Threads, signals, forks and other processes."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import FrameType

import pytest
import twinrig
from children import interrupted
from conftest import ROOT

LONG = {"duration": "1000000 s"}
SHORT = {"duration": "1 s", "expect": []}
TROT = "scenarios/trot.toml"


def run_at(frequency: float) -> twinrig.Run:
    return twinrig.run(TROT, set={**SHORT, "controller.frequency": f"{frequency} Hz"})


def fingerprint(frequency: float) -> str:
    return run_at(frequency).fingerprint


def test_results_do_not_depend_on_threads_or_processes() -> None:
    frequencies = [3.0, 3.2, 3.4, 3.6]
    expected = [fingerprint(frequency) for frequency in frequencies]
    assert len(set(expected)) == len(frequencies)
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(fingerprint, frequencies)) == expected
    with multiprocessing.get_context("spawn").Pool(2) as processes:
        runs = processes.map(run_at, frequencies)
    assert [run.fingerprint for run in runs] == expected
    assert all(len(run.signals["body/position"]) == 501 for run in runs)


def test_other_threads_continue_during_a_run() -> None:
    longest, stop = 0.0, threading.Event()

    def work() -> None:
        nonlocal longest
        last = time.perf_counter()
        while not stop.is_set():
            now = time.perf_counter()
            longest, last = max(longest, now - last), now

    thread = threading.Thread(target=work)
    thread.start()
    began = time.perf_counter()
    twinrig.run(TROT, set={"duration": "400 s"}, signals=["body/position"])
    took = time.perf_counter() - began
    stop.set()
    thread.join()
    # If the run kept the interpreter, the other thread would stand still all the time.
    assert longest < 0.5 * took


class Alarm(Exception):
    """Raised by a handler of the user."""


def test_handlers_of_the_user_run_and_end_a_run_only_by_an_exception(folder: Path) -> None:
    calls = 0

    def handler(number: int, frame: FrameType | None) -> None:
        nonlocal calls
        calls += 1
        if calls >= 3:
            raise Alarm

    before = signal.signal(signal.SIGALRM, handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.1, 0.1)
        with pytest.raises(Alarm) as raised:
            twinrig.run(TROT, set=LONG, signals=["body/position"], record=folder / "run.mcap")
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert calls == 3
    run: twinrig.Run = raised.value.run  # type: ignore[attr-defined]
    read = twinrig.read(folder / "run.mcap")
    assert read.is_complete and read.is_interrupted and read.fingerprint == run.fingerprint
    assert len(read.signals["body/position"]) == len(run.signals["body/position"]) > 100


INTERRUPTED = """
import os, signal, sys, threading, twinrig
def mask():
    status = open("/proc/self/status").read()
    return [line for line in status.splitlines() if line.startswith(("SigCgt", "SigIgn"))]
before = mask()
twinrig.run("scenarios/trot.toml")
twinrig.study("stability", plants=["massless"], duration="20 ms", budget=1, out=sys.argv[1])
assert mask() == before, "a handler has been installed"
print("ready", flush=True)
try:
    if sys.argv[2] == "study":
        twinrig.study("precision", budget=100000, out=sys.argv[1])
    else:
        # An advance to an observation takes longer than a test.
        slow = {"plant.constraints": "rigid", "plant.step": "1 ns", "observe.period": "10 ms"}
        setting = {"duration": "1000000 s", **(slow if sys.argv[2] == "slow" else {})}
        twinrig.run("scenarios/trot.toml", set=setting, signals=["body/position"])
except KeyboardInterrupt as interrupt:
    print("interrupted", getattr(interrupt, "run", None) is not None)
"""


@pytest.mark.parametrize(("kind", "has_run"), [("run", True), ("slow", True), ("study", False)])
def test_interrupt_ends_long_work(folder: Path, kind: str, has_run: bool) -> None:
    assert interrupted(INTERRUPTED, str(folder), kind) == (f"interrupted {has_run}\n", 0)


FORKED = """
import os, sys, twinrig
study = lambda: twinrig.study("estimate", particles=2, iterations=1, budget=1, out=sys.argv[1])
before = twinrig.run("scenarios/leg-drop.toml").fingerprint
try:
    study()
except twinrig.TwinError:
    pass
if os.fork() == 0:
    same = twinrig.run("scenarios/leg-drop.toml").fingerprint == before
    try:
        study()
    except twinrig.TwinError as error:
        os._exit(0 if same and "spawn" in str(error) else 2)
    os._exit(3)
os._exit(os.waitstatus_to_exitcode(os.wait()[1]))
"""


def test_fork_runs_but_does_not_wait_for_threads_it_has_not(folder: Path) -> None:
    words = [sys.executable, "-W", "ignore", "-c", FORKED, str(folder)]
    assert subprocess.run(words, cwd=ROOT, timeout=120, check=False).returncode == 0


def test_console_script_is_the_program(folder: Path) -> None:
    twin = Path(sys.executable).with_name("twin")
    environment = {**os.environ, "PATH": "/nonexistent"}

    def call(*words: str) -> tuple[int, str]:
        done = subprocess.run(
            [twin, *words], capture_output=True, text=True, cwd=ROOT, env=environment, check=False
        )
        return done.returncode, done.stdout

    code, out = call("run", TROT, "--no-record", "--set", "controller.frequency=3 Hz")
    assert code == 1 and out.startswith("trot  massless plant")
    assert call("run", TROT, "--no-record")[0] == 0
    assert call("run", "nonsense.toml")[0] == 2
    code, out = call("--version")
    assert code == 0 and out.startswith(f"twin {twinrig.__version__}\n")
