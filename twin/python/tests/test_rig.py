"""The stepped interface."""

from __future__ import annotations

import math
import os
import pickle
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import twinrig
from examples import LEGS, Spring, cart_rig
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

SCENARIOS = Path(__file__).parents[3] / "scenarios"
TROT = SCENARIOS / "trot.toml"
BUS = SCENARIOS / "oncilla-trot.toml"
WALK = SCENARIOS / "walk.toml"
SHORT = {"duration": "2 s", "expect": []}


@pytest.mark.parametrize("scenario", [TROT, BUS])
def test_stepped_rig_has_the_fingerprint_of_the_run(scenario: Path) -> None:
    with twinrig.Rig(scenario, set=SHORT) as rig:
        for end in (0.0, 1e-9, 0.0005, 1.0, 1.0, 1.345678901, 2.0):
            assert rig.step(until=end) == end == rig.now
        assert rig.fingerprint == twinrig.run(scenario, set=SHORT).fingerprint


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(0.0, 0.3), max_size=8))
def test_steps_of_any_length_give_the_same_rig(steps: list[float]) -> None:
    at_once, stepped = twinrig.Rig(TROT), twinrig.Rig(TROT)
    for step in steps:
        stepped.step(until=stepped.now + step)
    at_once.step(until=stepped.now)
    assert stepped.fingerprint == at_once.fingerprint


def test_restored_rig_continues_bit_for_bit() -> None:
    rig, other = twinrig.Rig(BUS), twinrig.Rig(BUS)
    rig.step(until=1.2345)
    saved = rig.save()
    rig.step(until=1.5)
    other.restore(pickle.loads(pickle.dumps(saved)))
    assert other.now == 1.2345
    other.step(until=1.5)
    ours, theirs = rig.read_all(), other.read_all()
    assert ours.keys() == theirs.keys() and len(ours) > 50
    assert all(np.array_equal(ours[name], theirs[name]) for name in ours)
    unbroken = rig.fingerprint
    assert other.fingerprint == unbroken
    rig.restore(saved)
    rig.step(until=1.5)
    assert rig.fingerprint == unbroken


def test_changed_state_is_refused_and_the_rig_stays() -> None:
    rig = twinrig.Rig(TROT, set=SHORT)
    rig.step(until=0.2)
    saved = rig.save()
    bits = np.random.default_rng(1).integers(8 * len(saved), size=2000)
    for bit in bits:
        flipped = bytearray(saved)
        flipped[bit // 8] ^= 1 << (bit % 8)
        with pytest.raises(ValueError, match="the bytes were changed"):
            rig.restore(bytes(flipped))
    assert rig.save() == saved


def test_variable_set_between_steps_is_a_change_of_the_scenario() -> None:
    change = {"change": [{"at": "1 s", "set": "frequency", "to": "3 Hz"}], **SHORT}
    rig = twinrig.Rig(TROT, set=SHORT)
    rig.step(until=0.999)
    rig.set_variable("frequency", 3.0)
    rig.step(until=2.0)
    assert {name: value for name, _, value, *_ in rig.variables()}["frequency"] == 3.0
    assert rig.fingerprint == twinrig.run(TROT, set=change).fingerprint


def test_written_output_replaces_that_of_the_controller() -> None:
    rig = twinrig.Rig(TROT)
    command = "leg/LF/hip/command"
    own = rig.read(command)
    rig.write(command, 0.3)
    assert np.array_equal(rig.read(command), own), "from the next control step on"
    for _ in range(100):
        rig.step()
        assert rig.read(command) == 0.3
    assert abs(rig.read("leg/LF/hip/position")[0] - 0.3) < 0.1
    assert rig.read("leg/RF/hip/command") != 0.3
    rig.write(command, None)
    rig.step()
    assert rig.read(command) != 0.3


def test_rig_ends_with_its_scenario() -> None:
    short = {"duration": "5 ms", "expect": []}
    rigs = [twinrig.Rig(TROT, set=short) for _ in range(2)]
    assert [rigs[0].step() for _ in range(3)] == [0.002, 0.004, 0.005]
    with pytest.raises(ValueError, match="the scenario ends at 5.000 ms"):
        rigs[0].step()
    assert twinrig.step_all(rigs[1:], 0.02) == [None] and rigs[1].now == 0.005
    with pytest.raises(ValueError, match="the scenario ends at 5.000 ms"):
        twinrig.step_all(rigs, 0.02)
    assert rigs[0].fingerprint == rigs[1].fingerprint == twinrig.run(TROT, set=short).fingerprint


def test_several_signals_are_read_at_once() -> None:
    rig = twinrig.Rig(TROT)
    names = [f"leg/{leg}/hip/position" for leg in LEGS]
    joined = rig.read(["body/rpy", *names])
    assert joined.shape == (7,)
    assert joined[3:].tolist() == [rig.read(name)[0] for name in names]
    assert rig.units["body/rpy"] == "rad"
    joined[:] = 9.0
    assert rig.read("body/rpy")[0] != 9.0, "values read are copies"


def test_rigs_advance_together_and_alone_alike() -> None:
    rigs = [twinrig.Rig(TROT, seed=seed) for seed in range(5)]
    for _ in range(10):
        assert twinrig.step_all(rigs, 0.02, threads=3) == [None] * 5
    alone = twinrig.Rig(TROT)
    alone.step(until=rigs[0].now)
    assert {rig.fingerprint for rig in rigs} == {alone.fingerprint}
    rigs[2].close()
    with pytest.raises(ValueError, match="closed"):
        twinrig.step_all(rigs, 0.02)
    assert rigs[0].now == alone.now, "no rig has moved"


Refused = Callable[[twinrig.Rig], Any]


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda rig: rig.step(until=math.nan), ValueError, "no simulated time"),
        (lambda rig: rig.step(until=-1.0), ValueError, "no simulated time"),
        (lambda rig: rig.step(until=1e300), ValueError, "no simulated time"),
        (lambda rig: rig.step(until="1 s"), TypeError, "str"),
        (lambda rig: rig.step(until=0.1), ValueError, "cannot step back"),
        (lambda rig: rig.read("body/positon"), KeyError, "did you mean `body/position`"),
        (lambda rig: rig.read(3), TypeError, "int"),
        (lambda rig: rig.write("body/position", 0.0), KeyError, "no output"),
        (lambda rig: rig.write("leg/LF/hip/command", [1.0, 2.0]), ValueError, "1 finite value"),
        (lambda rig: rig.write("leg/LF/hip/command", math.nan), ValueError, "finite"),
        (lambda rig: rig.write("leg/LF/hip/command", np.zeros((1, 1))), ValueError, "shape"),
        (lambda rig: rig.write("leg/LF/hip/command", 1j), TypeError, "complex"),
        (lambda rig: rig.write("leg/LF/hip/command", "x"), TypeError, "real numbers"),
        (lambda rig: rig.set_variable("frequncy", 1.0), KeyError, "did you mean `frequency`"),
        (lambda rig: rig.set_variable("duty_factor/fore", 1.5), ValueError, "1.5 is not in"),
        (lambda rig: rig.set_variable("frequency", math.nan), ValueError, "frequency = NaN"),
        (lambda rig: rig.set_variable("frequency", -5.0), ValueError, r"-5 is not in \[0, ∞\["),
        (lambda rig: rig.set_variable("frequency", 251.0), ValueError, "samples up to 250 Hz"),
        (lambda rig: rig.write("leg/LF/hip/command", 1e9), ValueError, r"not in \[-100, 100\] rad"),
        (lambda rig: rig.write("leg/RH/knee/command", -100.1), ValueError, "give a value within"),
        (lambda rig: rig.step(until=1e9), ValueError, "the scenario ends at 20"),
        (lambda rig: rig.step(until=20.000000001), ValueError, "build the rig with"),
        (lambda rig: rig.restore(b""), ValueError, "cut off"),
        (lambda rig: rig.restore(cart_rig().save()), ValueError, "another scenario"),
        (lambda rig: rig.restore(twinrig.Rig(WALK).save()), ValueError, "another scenario"),
        (lambda rig: rig.step(0.3), TypeError, "positional"),
        (lambda rig: pickle.dumps(rig), TypeError, "cannot be pickled"),
        (lambda rig: twinrig.step_all([rig, rig], 0.1), RuntimeError, "in use"),
    ],
)
def test_refused_call_leaves_the_rig_as_it_was(
    call: Refused, error: type[Exception], message: str
) -> None:
    rig, untouched = twinrig.Rig(TROT), twinrig.Rig(TROT)
    for each in (rig, untouched):
        each.step(until=0.2)
    with pytest.raises(error, match=message):
        call(rig)
    for each in (rig, untouched):
        each.step(until=0.4)
    assert rig.fingerprint == untouched.fingerprint


def test_closed_rig_refuses_every_call() -> None:
    with twinrig.Rig(TROT) as rig:
        saved = rig.save()
    assert "closed" in repr(rig)
    calls: list[Callable[[], Any]] = [
        rig.step,
        rig.save,
        rig.signals,
        rig.variables,
        rig.read_all,
        lambda: rig.read("body/position"),
        lambda: rig.write("leg/LF/hip/command", 0.0),
        lambda: rig.set_variable("frequency", 3.0),
        lambda: rig.restore(saved),
        lambda: rig.now,
        lambda: rig.fingerprint,
    ]
    for call in calls:
        with pytest.raises(ValueError, match="the rig is closed"):
            call()
    rig.close()


def test_forked_process_does_not_use_the_rig_of_its_parent() -> None:
    rig = twinrig.Rig(TROT)
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            rig.step()
            answer = "stepped"
        except RuntimeError as error:
            own = twinrig.Rig(TROT)
            own.step()
            answer = str(error)
        os.write(write, answer.encode())
        os._exit(0)
    os.close(write)
    with os.fdopen(read, encoding="utf-8") as pipe:
        answer = pipe.read()
    os.waitpid(child, 0)
    assert answer.startswith("the rig belongs to the process from which")
    rig.step()


def test_rig_in_use_by_another_thread_refuses_the_call() -> None:
    in_step, refused = threading.Event(), threading.Event()

    class Waiting(Spring):
        def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
            if elapsed > 0.0:  # not for the initial commands, while the rig is built
                in_step.set()
                assert refused.wait(60.0)
            super().step(elapsed, inputs, outputs)

    rig = cart_rig(controller=Waiting)
    thread = threading.Thread(target=rig.step, kwargs={"until": 0.01})
    thread.start()
    try:
        assert in_step.wait(60.0)
        with pytest.raises(RuntimeError, match="the rig is in use"):
            rig.read("cart/position")
    finally:
        refused.set()
        thread.join()
    assert 0.0 < rig.read("cart/position") < 1.0


Anything = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=20),
    st.binary(max_size=40),
    st.lists(st.floats(), max_size=4),
    st.sampled_from(
        [
            "body/position",
            "leg/LF/hip/command",
            "frequency",
            "step_length",
            np.zeros(1),
            np.zeros(0),
            np.zeros((2, 2), dtype=np.float32),
            np.array(["a"], dtype=object),
            np.array([1], dtype=np.uint8),
            np.full(1, np.nan),
            object(),
            {},
        ]
    ),
)
METHODS = ["step", "read", "write", "set_variable", "restore", "close", "variables", "save"]
EXPECTED = (TypeError, ValueError, KeyError, OverflowError, RuntimeError, twinrig.TwinError)


@settings(max_examples=500, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    st.lists(
        st.tuples(st.sampled_from(METHODS), st.lists(Anything, max_size=3)),
        min_size=20,
        max_size=20,
    )
)
def test_random_calls_raise_exceptions_only(calls: list[tuple[str, list[Any]]]) -> None:
    rig = twinrig.Rig(TROT, signals=["body/**"])
    saved = rig.save()
    for method, arguments in calls:
        if method == "step" and arguments and isinstance(arguments[0], (int, float)):
            # A step of years is valid, and takes hours.
            arguments[0] = min(0.3, arguments[0])
        try:
            getattr(rig, method)(*arguments)
        except EXPECTED:
            pass
    try:
        rig.restore(saved)
        assert rig.step() == rig.period
    except ValueError as error:
        assert "closed" in str(error)
