"""Controllers and plants in Python."""

from __future__ import annotations

import functools
import gc
import sys
import threading
import time
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import twinrig
from children import interrupted
from examples import CART, COMMANDS, SWING, Cart, Spring, Swing, cart_rig
from twinrig import Input, Output, Variable

SCENARIOS = Path(__file__).parents[3] / "scenarios"
TROT = SCENARIOS / "trot.toml"


def cart(**changed: Any) -> twinrig.Run:
    """Run the cart, with other parts if given."""
    return twinrig.run(
        CART,
        plants={"cart": changed.get("plant", Cart)},
        controllers={"spring": changed.get("controller", Spring)},
    )


def test_cart_oscillates_as_the_closed_form() -> None:
    run = cart()
    position = run.signals["cart/position"]
    # Symplectic Euler with steps of 1 ms, under commands held for 1 ms: first order.
    assert np.abs(position - np.cos(2.0 * position.time)).max() < 0.02
    assert run.verdict == "pass"
    assert run.signals["cart/force"].unit == "N"


def test_expectation_fails_when_the_physics_is_wrong() -> None:
    class Pushed(Cart):
        def advance(self, to: float, inputs: Any) -> None:
            super().advance(to, inputs + 4.4)

    assert cart(plant=Pushed).verdict == "fail"


def test_class_and_object_give_the_same_run_and_the_object_is_not_changed() -> None:
    used = Swing()
    used.time = 0.0
    first = twinrig.run(TROT, set=SWING, controllers={"swing": Swing})
    again = [twinrig.run(TROT, set=SWING, controllers={"swing": used}) for _ in range(2)]
    made = twinrig.run(TROT, set=SWING, controllers={"swing": lambda: Swing()})
    assert {run.fingerprint for run in (first, made, *again)} == {first.fingerprint}
    assert used.time == 0.0


def test_variables_are_keys_of_the_scenario_and_of_changes() -> None:
    change = {"change": [{"at": "1 s", "set": "amplitude", "to": "0.4 rad"}]}
    run = twinrig.run(
        TROT,
        set={**SWING, **change, "controller.amplitude": "0.1 rad", "duration": "2 s"},
        controllers={"swing": Swing},
    )
    command = run.signals["leg/LF/hip/command"]
    before, after = (np.abs(command[chosen]).max() for chosen in (command.time < 1, command.time > 1))
    assert before == pytest.approx(0.1, abs=1e-3) and after == pytest.approx(0.4, abs=1e-3)
    with pytest.raises(twinrig.ScenarioError, match="amplitude"):
        twinrig.run(
            TROT, set={**SWING, "controller.amplitude": "2 rad"}, controllers={"swing": Swing}
        )


def test_rig_with_python_parts_is_saved_and_restored() -> None:
    rig = cart_rig()
    rig.step(until=1.0)
    saved = rig.save()
    rig.step(until=2.0)
    expected = rig.read_all()
    other = cart_rig()
    other.restore(saved)
    other.step(until=2.0)
    assert other.read_all() == expected


def failing(error: BaseException, after: float = 1.0) -> type[Swing]:
    """Return a controller that raises at a time."""

    class Failing(Swing):
        def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
            super().step(elapsed, inputs, outputs)
            if self.time > after:
                raise error

    return Failing


@pytest.mark.parametrize("error", [LookupError("no table"), KeyboardInterrupt(), SystemExit(3)])
def test_exception_of_a_controller_is_raised_and_nothing_is_lost(
    error: BaseException, tmp_path: Path
) -> None:
    recording = tmp_path / "failed.mcap"
    with pytest.raises(type(error)) as raised:
        twinrig.run(TROT, set=SWING, controllers={"swing": failing(error)}, record=recording)
    run: twinrig.Run = raised.value.run  # type: ignore[attr-defined]
    assert run.verdict == "error" and "swing failed at 1.000 s" in str(run.error)
    kept = run.signals["body/position"]
    assert kept.time[-1] >= 0.99
    assert np.array_equal(twinrig.read(recording).signals["body/position"], kept)


def test_rig_raises_the_exception_of_its_controller_then_its_own() -> None:
    rig = twinrig.Rig(TROT, set=SWING, controllers={"swing": failing(LookupError("no table"))})
    with pytest.raises(LookupError, match="no table"):
        rig.step(until=2.0)
    assert 1.0 <= rig.now < 1.01
    with pytest.raises(twinrig.TwinError, match="swing failed at 1.000 s: LookupError: no table"):
        rig.step(until=2.0)


def test_exception_of_an_observation_is_raised() -> None:
    class Blind(Cart):
        def observe(self, outputs: Any) -> None:
            if self.time > 4.9995:
                raise LookupError("dark")
            super().observe(outputs)

    with pytest.raises(LookupError, match="dark"):
        cart(plant=Blind)


@pytest.mark.parametrize(("value", "after"), [(np.nan, 1.0), (-np.inf, 1.0), (np.nan, 4.9995)])
def test_observation_that_is_no_number_is_refused_by_name(value: float, after: float) -> None:
    class Broken(Cart):
        def observe(self, outputs: Any) -> None:
            super().observe(outputs)
            if self.time > after:
                outputs[1] = value

    with pytest.raises(ValueError, match="wrote (NaN|-inf) to `cart/speed`") as raised:
        cart(plant=Broken)
    run: twinrig.Run = raised.value.run  # type: ignore[attr-defined]
    assert run.verdict == "error" or after > 4.0
    assert after <= run.signals["cart/speed"].time[-1] <= after + 0.002


class Holder:
    """Object that refers to a rig, and that a part of the rig refers to."""

    rig: twinrig.Rig


def test_rig_in_a_cycle_with_its_parts_is_collected() -> None:
    def linked(part: type[Any], holder: Holder) -> Any:
        instance = part()
        instance.holder = holder
        # A rig cannot be pickled with the attributes.
        instance.save, instance.restore = lambda: b"", lambda state: None
        return instance

    # The rig calls the factory when it is built, and does not keep it.
    for name, part in (("controller", Spring), ("plant", Cart)):
        holder = Holder()
        holder.rig = cart_rig(**{name: functools.partial(linked, part, holder)})
        holder.rig.step(until=0.1)
        alive = weakref.ref(holder)
        gc.collect()
        # A collection of objects in use would fail this step.
        holder.rig.step(until=0.2)
        del holder
        assert alive() is not None
        gc.collect()
        assert alive() is None, name


def test_controller_cannot_use_its_own_rig() -> None:
    rigs: list[twinrig.Rig] = []

    class Recursive(Spring):
        def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
            for rig in rigs:
                rig.step()

    rigs.append(cart_rig(controller=Recursive))
    with pytest.raises(RuntimeError, match="the rig is in use"):
        rigs[0].step()


COMMAND = Output("cart/force", "N")


def with_step(body: Any) -> type[Spring]:
    return type("Made", (Spring,), {"step": body})


def resize(_: Any, __: float, ___: Any, outputs: Any) -> None:
    outputs.resize(3, refcheck=False)


def lock(_: Any, __: float, inputs: Any, outputs: Any) -> None:
    inputs.setflags(write=False)
    outputs.setflags(write=False)


@pytest.mark.parametrize(
    ("controller", "error", "message"),
    [
        (3, TypeError, "int has no method `step`"),
        (object, TypeError, "object has no method `step`"),
        (type("Portless", (), {"step": print}), TypeError, "no attribute `ports`"),
        (type("Odd", (Spring,), {"ports": [3]}), AttributeError, "name"),
        (type("Odd", (Spring,), {"ports": [Output("cart/force", "kN")]}), ValueError, "no unit"),
        (type("Odd", (Spring,), {"ports": [Output("x", "N", -1)]}), OverflowError, "negative"),
        (
            type("Odd", (Spring,), {"variables": [Variable("gain", "1", 2.0, max=1.0)]}),
            ValueError,
            "not in its range",
        ),
        (with_step(lambda *_: 5), TypeError, "returns None"),
        (with_step(lambda s, e, i, o: o.fill(np.nan)), twinrig.RunError, "NaN"),
        (with_step(lambda s, e, i, o: o.__setitem__(0, np.zeros(2))), ValueError, "sequence"),
        (with_step(resize), ValueError, "belong to the rig"),
        (with_step(lock), ValueError, "belong to the rig"),
        (type("Lost", (Spring,), {"save": lambda self: 3}), TypeError, "bytes"),
        (
            type("Slots", (), {"__slots__": (), "ports": Spring.ports, "step": Spring.step}),
            TypeError,
            "save",
        ),
        (
            type("Odd", (Spring,), {"ports": [COMMAND, Input("cart/positon", "m")]}),
            twinrig.ScenarioError,
            "positon",
        ),
    ],
)
def test_invalid_controller_is_an_exception(
    controller: Any, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        cart(controller=controller)


def test_reference_run_has_a_controller_of_its_own() -> None:
    used: list[Swing] = []

    class Noted(Swing):
        def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
            super().step(elapsed, inputs, outputs)
            if elapsed > 0.0 and all(self is not other for other in used):
                used.append(self)

    displacement = {"displacement": {"max": "1 mm"}, "against": "without changes"}
    expect = [{"name": "same footsteps", "footstep": displacement}]
    change = [{"at": "1 s", "set": "amplitude", "by": "0 rad"}]
    changed = {**SWING, "expect": expect, "change": change, "duration": "2 s"}
    twinrig.run(TROT, set=changed, controllers={"swing": Noted()})
    assert [round(each.time, 9) for each in used] == [2.0, 2.0]


def test_other_threads_run_while_rust_does() -> None:
    counted, stop = [0], threading.Event()

    def count() -> None:
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0)

    thread = threading.Thread(target=count)
    thread.start()
    rig = twinrig.Rig(TROT)
    before = counted[0]
    rig.step(until=20.0)
    after = counted[0]
    stop.set()
    thread.join()
    # One call of some 50 ms: the other thread would be held in it.
    assert after > before


ENDLESS = """
import sys
sys.path.insert(0, sys.argv[1])
import twinrig
from children import interrupted
from examples import SWING, Swing
print("ready", flush=True)
try:
    twinrig.run(sys.argv[2], set={**SWING, "duration": "600 min", "record.signals": []},
                controllers={"swing": Swing})
except KeyboardInterrupt as interrupt:
    print(interrupt.run.report["simulated_s"] > 0.0)
"""


def test_ctrl_c_ends_a_run_with_a_python_controller() -> None:
    tests = str(Path(__file__).parent)
    assert interrupted(ENDLESS, tests, str(TROT), after=1.0) == ("True\n", 0)


STEPS = """
import sys, twinrig
rigs = [twinrig.Rig(sys.argv[1], set={"duration": "1e6 s"}) for _ in range(3)]
rigs[0].step(until=0.5)
print("ready", flush=True)
try:
    twinrig.step_all(rigs, 1e6, threads=2)
except KeyboardInterrupt:
    late, *others = [rig.now for rig in rigs]
    print(others[0] > 0.0, others[0] == others[1], abs(late - others[0] - 0.5) < 1e-9)
    twinrig.step_all(rigs, 0.01)
"""


def test_ctrl_c_ends_a_step_of_several_rigs_at_the_same_time() -> None:
    assert interrupted(STEPS, str(TROT)) == ("True True True\n", 0)


def test_command_of_every_leg_is_required() -> None:
    three = type("Three", (Swing,), {"ports": COMMANDS[:6]})
    run = twinrig.run(TROT, set={**SWING, "duration": "1 s"}, controllers={"swing": three})
    assert run.verdict == "pass"
