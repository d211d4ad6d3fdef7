"""Rollouts: the bits of single rigs, errors of one run, and arguments."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import twinrig
from examples import SWING, Swing

SCENARIOS = Path(__file__).parents[3] / "scenarios"
TROT = SCENARIOS / "trot.toml"
BUS = SCENARIOS / "oncilla-trot.toml"
HIP = "leg/LF/hip/command"
SIGNALS = ["body/position", "leg/*/hip/position", HIP]
LANES, STEPS = 5, 40


def commands(lanes: int = LANES, steps: int = STEPS) -> dict[str, Any]:
    random = np.random.default_rng(1)
    return {
        "frequency": random.uniform(1.0, 3.5, (lanes, steps)),
        HIP: random.uniform(-0.2, 0.2, (lanes, steps, 1)),
    }


def moved(scenario: Path, seconds: float, **arguments: Any) -> bytes:
    """Return the state of a rig that has run for some time."""
    rig = twinrig.Rig(scenario, **arguments)
    rig.step(until=seconds)
    return rig.save()


def check_lane(
    found: twinrig.Trajectories, lane: int, rig: twinrig.Rig, given: dict[str, Any], step: float
) -> None:
    """Compare a lane with a rig that Python steps."""
    for k in range(found.time.shape[1]):
        for name, values in given.items():
            value = values[lane, k]
            rig.write(name, value) if "/" in name else rig.set_variable(name, value)
        rig.step(until=rig.now + step)
        assert found.matrix[lane, k].tolist() == rig.read(list(found)).tolist()
        assert found.time[lane, k] == rig.now
        assert found.has_fallen[lane, k] == rig.has_fallen
    assert found.states[lane] == rig.save()


@pytest.mark.parametrize("scenario", [TROT, BUS])
@pytest.mark.parametrize("threads", [1, 2, 3])
def test_lanes_are_rigs_bit_for_bit(scenario: Path, threads: int) -> None:
    given = commands()
    begins = [moved(scenario, 0.05 * (1 + lane)) for lane in range(LANES)]
    found = twinrig.rollout(scenario, begins, given, SIGNALS, step=0.01, threads=threads)
    assert found.errors == []
    assert found["body/position"].shape == (LANES, STEPS, 3)
    assert found[HIP].shape == (LANES, STEPS)
    assert list(found)[:2] == ["body/position", "leg/LF/hip/position"] and len(found) == 6
    for lane, begin in enumerate(begins):
        rig = twinrig.Rig(scenario)
        rig.restore(begin)
        check_lane(found, lane, rig, given, 0.01)


def test_variables_of_lanes_need_no_other_rig() -> None:
    varied = {"step_length": np.linspace(0.05, 0.14, LANES)}
    given = {HIP: commands()[HIP]}
    begin = moved(TROT, 0.3)
    found = twinrig.rollout(TROT, begin, given, SIGNALS, set=varied)
    for lane in range(LANES):
        rig = twinrig.Rig(TROT)
        rig.restore(begin)
        rig.set_variable("step_length", varied["step_length"][lane])
        check_lane(found, lane, rig, given, rig.period)


def test_settings_of_lanes_are_those_of_their_rigs() -> None:
    varied = {
        "plant.ground.friction": np.array([0.05, 0.6, 0.9]),
        "controller.step_height": np.array(["15 mm", "20 mm", "10 mm"]),
    }
    common = {"actuator.lag": "6 ms"}
    prepared = twinrig.Rollout(TROT, SIGNALS, step=0.02, set=common)
    found = prepared.run(None, {}, set=varied, steps=STEPS)
    rigs = []
    for lane in range(3):
        settings = {key: values[lane].item() for key, values in varied.items()}
        rigs.append(twinrig.Rig(TROT, set={**common, **settings}))
        check_lane(found, lane, rigs[-1], {}, 0.02)
    begins = [state for state in found.states if state is not None]
    # A state belongs to its settings.
    further = prepared.run(begins, {}, set=varied, steps=10)
    for lane, rig in enumerate(rigs):
        check_lane(further, lane, rig, {}, 0.02)
    others = prepared.run(begins, {}, steps=10)
    assert [error.lane for error in others.errors] == [0, 1, 2]
    assert all("another scenario" in str(error) for error in others.errors)


def test_rollouts_continue_and_repeat() -> None:
    given = commands()
    prepared = twinrig.Rollout(TROT, SIGNALS)
    whole = prepared.run(None, given)
    split = {name: np.split(values, 2, axis=1) for name, values in given.items()}
    halves = [{name: parts[i] for name, parts in split.items()} for i in range(2)]
    first = prepared.run(None, halves[0])
    begins = [state for state in first.states if state is not None]
    second = prepared.run(begins, halves[1])
    for attribute in ("matrix", "time", "has_fallen"):
        joined = [getattr(half, attribute) for half in (first, second)]
        np.testing.assert_array_equal(np.concatenate(joined, axis=1), getattr(whole, attribute))
    assert second.states == whole.states == prepared.run(None, given).states


def test_without_fingerprints_the_signals_are_the_same() -> None:
    given = commands()
    hashed = twinrig.rollout(TROT, None, given, SIGNALS)
    plain = twinrig.rollout(TROT, None, given, SIGNALS, fingerprint=False)
    np.testing.assert_array_equal(plain.matrix, hashed.matrix)
    rig = twinrig.Rig(TROT)
    assert plain.states[0] is not None and hashed.states[0] is not None
    rig.restore(plain.states[0])
    with pytest.raises(ValueError, match="no fingerprint"):
        rig.fingerprint
    rig.step()
    rig.restore(hashed.states[0])
    assert len(rig.fingerprint) == 64
    # A rig that does not hash goes on without.
    rig = twinrig.Rig(TROT, fingerprint=False)
    rig.restore(hashed.states[0])
    with pytest.raises(ValueError, match="no fingerprint"):
        rig.fingerprint
    assert rig.save() == plain.states[0]


def test_failure_of_a_lane_leaves_the_others() -> None:
    given = commands()
    whole = twinrig.rollout(TROT, None, given, SIGNALS)
    given["frequency"][1, 7] = -1.0
    given[HIP][3, 0] = np.nan
    begin = twinrig.Rig(TROT).save()
    begins = [begin, begin, moved(TROT, 0.0, set={"plant.ground.friction": 0.5}), begin, begin]
    for threads in (1, 2):
        found = twinrig.rollout(TROT, begins, given, SIGNALS, threads=threads)
        assert [(error.lane, error.step) for error in found.errors] == [(1, 7), (2, 0), (3, 0)]
        assert found.errors[0].time == 7 * 0.002
        assert all(isinstance(error.error, ValueError) for error in found.errors)
        assert "-1 is not in" in str(found.errors[0])
        assert np.isnan(found.errors[1].time)
        for lane, steps in enumerate([STEPS, 7, 0, 0, STEPS]):
            same = (whole.matrix[lane, :steps], found.matrix[lane, :steps])
            np.testing.assert_array_equal(*same)
            assert np.isnan(found.matrix[lane, steps:]).all()
            assert np.isnan(found.time[lane, steps:]).all()
            assert not found.has_fallen[lane, steps:].any()
            assert found.states[lane] == (whole.states[lane] if steps == STEPS else None)


class Timid(Swing):
    """Fails where its amplitude is large."""

    def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
        if self.amplitude > 0.4:
            raise LookupError(f"amplitude {self.amplitude}")
        super().step(elapsed, inputs, outputs)


def test_exception_of_a_part_is_that_of_its_lane() -> None:
    scenario: dict[str, Any] = {
        "scenario": SCENARIOS / "stand.toml",
        "set": {**SWING, "change": []},
        "controllers": {"swing": Timid},
    }
    amplitudes = np.full((4, 30), 0.1)
    amplitudes[2, 12:] = 0.45
    given = {"amplitude": amplitudes}
    found = twinrig.rollout(commands=given, states=None, signals=["body/rpy"], **scenario)
    (error,) = found.errors
    assert (error.lane, error.step) == (2, 12)
    assert isinstance(error.error, LookupError) and str(error.error) == "amplitude 0.45"
    for lane in (0, 1, 3):
        check_lane(found, lane, twinrig.Rig(**scenario), given, 0.002)


def test_lanes_end_with_the_scenario() -> None:
    short = {"duration": "5 ms", "expect": []}
    found = twinrig.rollout(TROT, None, {}, [], set={**short, "seed": np.arange(2)}, steps=4)
    assert found.time.tolist()[0][:3] == [0.002, 0.004, 0.005]
    assert [(error.lane, error.step) for error in found.errors] == [(0, 3), (1, 3)]
    assert "the scenario ends at 5.000 ms" in str(found.errors[0])
    assert found.matrix.shape == (2, 4, 0)


Call = Callable[[twinrig.Rollout], Any]


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda one: one.run(None, {}), ValueError, "number of lanes follows from no"),
        (lambda one: one.run([], {}), ValueError, "number of steps follows from no"),
        (lambda one: one.run(None, {"frequency": [3.0]}), ValueError, r"expected the shape \(N, T\)"),
        (lambda one: one.run(None, {"frequency": np.ones((2, 3, 2))}), ValueError, r"\(2, 3, 1\)"),
        (lambda one: one.run([b""], {"frequency": [[3.0]] * 2}), ValueError, "has 2 lanes"),
        (lambda one: one.run(None, {"frequency": [[3.0]]}, steps=2), ValueError, "has 1 steps"),
        (lambda one: one.run(None, {"frequncy": [[3.0]]}), KeyError, "no output"),
        (lambda one: one.run(None, {}, set={"frequency": 3.0}, steps=1), TypeError, "an array"),
        (lambda one: one.run(3, {}, steps=1), TypeError, "int"),
        (lambda one: one.run(None, {"frequency": "x"}), ValueError, "could not convert"),
        (lambda one: one.run([b""] * 2, {}, steps=-1), ValueError, "at least 0"),
        (lambda one: one.run([b""] * 2, {}, steps=2**61), MemoryError, "fit into memory"),
        (lambda one: one.run(None, {"frequency": [[3.0]]})["body/rpy"], KeyError, "there is no"),
        (lambda one: twinrig.Rollout(TROT, "body/rpy"), TypeError, "not str"),
        (lambda one: twinrig.Rollout(TROT, ["body/rpm"]), KeyError, "did you mean `body/rpy`"),
        (lambda one: twinrig.Rollout(TROT, ["*/rpm"]), ValueError, "no signal"),
    ],
)
def test_arguments_are_checked(call: Call, error: Any, message: str) -> None:
    prepared = twinrig.Rollout(TROT, SIGNALS)
    with pytest.raises(error, match=message):
        call(prepared)
    assert prepared.run(None, {"frequency": [[3.0]]}).errors == []


def test_wrong_settings_are_errors_of_their_lanes() -> None:
    varied = {"plant.ground.friction": np.array([0.5, -1.0])}
    found = twinrig.rollout(TROT, None, {}, SIGNALS, set=varied, steps=3)
    assert [error.lane for error in found.errors] == [1]
    assert isinstance(found.errors[0].error, twinrig.ScenarioError)


def test_rollouts_in_several_threads_are_independent() -> None:
    given = commands()
    prepared = twinrig.Rollout(TROT, SIGNALS, threads=2)
    expected = prepared.run(None, given).states
    found: list[Any] = []
    threads = [
        threading.Thread(target=lambda: found.append(prepared.run(None, given).states))
        for _ in range(3)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [expected] * 3


def test_exception_of_a_signal_handler_ends_the_call() -> None:
    def handler(*_: Any) -> None:
        raise InterruptedError("alarm")

    long = {"duration": "100000 s", "expect": []}
    prepared = twinrig.Rollout(TROT, SIGNALS, step=5.0, set=long)
    before = signal.signal(signal.SIGALRM, handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(InterruptedError, match="alarm"):
            prepared.run([twinrig.Rig(TROT, set=long).save()] * 3, {}, steps=10_000)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert prepared.run(None, {"frequency": [[3.0]]}, steps=1).errors == []
