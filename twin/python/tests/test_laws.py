"""Laws of drivers in Python: a sound driver obeys them, and each planted flaw is found."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator
from typing import Any, ClassVar, get_args, get_type_hints

import pytest
import ranger
import twinrig
from hypothesis import Phase, given, settings
from ranger import Board, Ranger, setup
from twinrig import Input, Output, _native, laws
from twinrig.laws import Case, Damage, Law

FIXED = laws.config(derandomize=True, database=None, max_examples=40)
"""The same cases in every run."""

TestSound = laws.tests(setup(), settings=settings(FIXED, max_examples=8))


def violation(law: Law, given_setup: laws.Setup, *phases: Phase) -> tuple[laws.Violation, Case]:
    """Return the violation that Hypothesis finds, with its case."""
    cases: list[Case] = []

    @settings(FIXED, phases=phases)
    @given(laws.cases())
    def check(case: Case) -> None:
        cases.append(case)
        law(given_setup, case)

    with pytest.raises(laws.Violation) as raised:
        check()
    return raised.value, cases[-1]


@pytest.mark.parametrize(
    ("flaw", "law"),
    [
        (ranger.IgnoresChecksum, laws.values_were_sent),
        (ranger.AcceptsOtherAddresses, laws.values_were_sent),
        (ranger.AcceptsOldAnswers, laws.values_were_sent),
        (ranger.CountsTimeOutsAsAnswers, laws.traffic_adds_up),
        (ranger.DoesNotCountDamage, laws.traffic_adds_up),
        (ranger.LosesBytesBetweenPieces, laws.cuts_change_nothing),
        (ranger.CountsLooksAsTimeOuts, laws.looks_change_nothing),
        (ranger.DoesNotSavePartialFrame, laws.restores_in_mid_frame),
        (ranger.BoardDoesNotSavePartialFrame, laws.restores_in_mid_frame),
        (ranger.NeverResynchronises, laws.recovers),
        (ranger.KeepsAllFrames, laws.queues_stay_bounded),
        (ranger.KeepsAllAnswers, laws.queues_stay_bounded),
        (ranger.NoTimeOut, laws.meets_the_deadline),
        (ranger.BytesPostponeTimeOut, laws.meets_the_deadline),
    ],
)
def test_each_flaw_is_found_by_its_law(flaw: type[Any], law: Law) -> None:
    part = "board" if issubclass(flaw, Board) else "driver"
    found, _ = violation(law, setup(**{part: flaw}), Phase.generate)
    assert found.law == law.__name__ and found.at >= 0
    assert str(found).startswith(f"{found.law} is violated at ") and found.what in str(found)
    again = pickle.loads(pickle.dumps(found))
    assert (again.law, again.at, again.what) == (found.law, found.at, found.what)


def test_hypothesis_shrinks() -> None:
    flawed = setup(ranger.LosesBytesBetweenPieces)
    _, case = violation(laws.cuts_change_nothing, flawed, Phase.generate, Phase.shrink)
    assert case == Case(
        to_driver=[], to_devices=[], pieces=[1], looks=[40], saved=0, saved_at=0, garbage=b"\0"
    )


def test_a_law_of_a_case_is_a_function() -> None:
    flawed = setup(ranger.NeverResynchronises)
    laws.recovers(flawed, Case())
    with pytest.raises(laws.Violation, match=r"recovers is violated at \d+\.\d+ ms: "):
        laws.recovers(flawed, Case(to_driver=[Damage(after=0, kind="insertion", number=1)]))


def test_tests_are_those_of_some_laws() -> None:
    first = settings(FIXED, phases=[Phase.generate])
    some = laws.tests(setup(ranger.NoTimeOut), [laws.recovers], settings=first)
    names = [[name for name in vars(it) if name.startswith("test_")] for it in (some, TestSound)]
    assert names == [["test_recovers"], [f"test_{law.__name__}" for law in laws.LAWS]]
    with pytest.raises(laws.Violation, match="recovers"):
        some().test_recovers()


RANGES = _native.case_ranges()


class Spy(Ranger):
    """Driver that notes what happens to it."""

    calls: ClassVar[list[tuple[Any, ...]]] = []

    def handle_bytes(self, now: int, data: bytes) -> None:
        self.calls.append((now, data))
        super().handle_bytes(now, data)

    def handle_timeout(self, now: int) -> None:
        self.calls.append((now,))
        super().handle_timeout(now)


def course(law: Law, **changed: Any) -> list[tuple[Any, ...]]:
    Spy.calls.clear()
    law(setup(Spy), Case(**changed))
    return list(Spy.calls)


def ends_of_ranges() -> Iterator[tuple[Law, dict[str, Any], dict[str, Any]]]:
    """Cases at both ends of each range, which have to be different courses under a law."""
    for kind, _, to_devices, numbers in RANGES["kinds"]:
        for direction in ("to_driver", "to_devices")[: 1 + to_devices]:
            for number in numbers:
                yield laws.recovers, {direction: [Damage(0, kind, number)]}, {}
    first, last = ([Damage(after, "loss", 1)] for after in RANGES["after"])
    yield laws.recovers, {"to_driver": first}, {"to_driver": last}
    for name in ("to_driver", "to_devices"):
        fewest, most = ([Damage(2, "wrong bit")] * count for count in RANGES[name])
        yield laws.recovers, {name: fewest}, {name: most}
    for name, law in {
        "pieces": laws.cuts_change_nothing,
        "looks": laws.looks_change_nothing,
        "garbage": laws.meets_the_deadline,
    }.items():
        (shortest, longest), (least, greatest) = RANGES[name]
        lists = [[least] * shortest, [greatest] * longest]
        one, other = map(bytes, lists) if name == "garbage" else lists
        yield law, {name: one}, {name: other}
    for name in ("saved", "saved_at"):
        least, greatest = RANGES[name]
        yield laws.restores_in_mid_frame, {name: least}, {name: greatest}


@pytest.mark.parametrize(("law", "one", "other"), [*ends_of_ranges()])
def test_every_range_is_accepted_and_used(
    law: Law, one: dict[str, Any], other: dict[str, Any]
) -> None:
    assert course(law, **one) != course(law, **other)
    assert course(law, **one) == course(law, **one)


def test_cases_have_damage_of_every_kind() -> None:
    drawn: set[tuple[bool, str]] = set()

    @settings(FIXED, max_examples=100)
    @given(laws.cases())
    def draw(case: Case) -> None:
        drawn.update((True, it.kind) for it in case.to_driver)
        drawn.update((False, it.kind) for it in case.to_devices)

    draw()
    kinds = set(get_args(get_type_hints(Damage)["kind"]))
    assert kinds == {kind for kind, *_ in RANGES["kinds"]}
    expected = {(True, kind) for kind in kinds} | {(False, kind) for kind in kinds - {"frame"}}
    assert drawn == expected


def failing(part: type[Any], method: str) -> type[Any]:
    def fail(*_: object) -> None:
        raise LookupError(f"no table in {method}")

    return type("Failing", (part,), {method: fail})


DRIVER = "open begin close handle_bytes handle_timeout poll_timeout poll_transmit is_busy traffic"
DEVICE = "receive next_wake advance poll_transmit"
STATE = ("__init__", "save", "restore")


@pytest.mark.parametrize(
    ("part", "method"),
    [
        *((Ranger, method) for method in (*DRIVER.split(), *STATE)),
        *((Board, method) for method in (*DEVICE.split(), *STATE)),
    ],
)
def test_exceptions_of_parts_propagate(part: type[Any], method: str) -> None:
    flawed = failing(part, method)
    with pytest.raises(LookupError, match=f"no table in {method}") as raised:
        given_setup = setup(**{"driver" if part is Ranger else "board": flawed})
        for law in laws.LAWS:
            law(given_setup, Case(to_driver=[Damage(0, "loss", 1)]))
    assert traceback.extract_tb(raised.tb)[-1].name == "fail"


def test_os_error_is_the_failure_of_the_devices() -> None:
    deaf = type("Deaf", (Board,), {"receive": lambda *_: None})
    laws.meets_the_deadline(setup(board=deaf), Case())
    with pytest.raises(laws.Violation, match=r"fails at .* \(the board does not answer: check"):
        laws.traffic_adds_up(setup(board=deaf), Case())


def test_exceptions_of_levels_and_commands_propagate() -> None:
    def fail(_: int, component: int) -> float:
        raise LookupError(component)

    for name in ("levels", "commands"):
        with pytest.raises(LookupError):
            laws.recovers(setup(**{name: fail}), Case())


def with_method(part: type[Any], name: str, result: Any) -> dict[str, Any]:
    made = type("Made", (part,), {name: lambda *_: result})
    return {"driver" if part is Ranger else "board": made}


@pytest.mark.parametrize(
    ("changed", "error", "message"),
    [
        ({"driver": 3}, TypeError, "int has no method `open`"),
        ({"driver": object}, TypeError, "object has no method `open`"),
        ({"board": Ranger}, TypeError, "Ranger has no method `receive`"),
        ({"byte_time": "87 m"}, ValueError, "byte_time: "),
        ({"byte_time": 0}, ValueError, "byte_time: 0 is too short"),
        ({"byte_time": 87e-6}, TypeError, "`byte_time` is 8.7e-05: expected a text"),
        ({"byte_time": None}, TypeError, "byte_time"),
        ({"recovery": -1}, TypeError, "`recovery` is -1: expected a number of periods"),
        ({"levels": 3}, TypeError, "`levels` is 3"),
        ({"detection": "none"}, ValueError, "none of `all damage`, `wrong bits`"),
        ({"foreign_frames": [3]}, TypeError, "foreign_frames"),
        ({"ports": []}, ValueError, "devices: .*distance"),
        ({"ports": [Output("distance", "kg"), Input("command", "m")]}, ValueError, "distance"),
        ({"levels": lambda *_: 0.5}, twinrig.TwinError, "choose other levels"),
        ({"levels": lambda *_: "high"}, TypeError, "`levels` is 'high'"),
        (with_method(Ranger, "poll_timeout", 1.5), TypeError, r"`poll_timeout\(\)` is 1.5"),
        (with_method(Ranger, "poll_transmit", "abc"), TypeError, r"`poll_transmit\(\)` is 'abc'"),
        (with_method(Ranger, "is_busy", None), TypeError, r"`is_busy\(\)` is None"),
        (with_method(Ranger, "traffic", (1, 2)), TypeError, r"`traffic\(\)` is \(1, 2\)"),
        (with_method(Board, "next_wake", -5), TypeError, r"`next_wake\(\)` is -5"),
        (with_method(Board, "advance", 3), TypeError, "returns None"),
        (with_method(Board, "poll_transmit", (0, b"late")), ValueError, "at 0 ns, and it is"),
        (with_method(Board, "poll_transmit", (2**64 - 1, b"x")), ValueError, "and it is"),
        (with_method(Board, "poll_transmit", (10**9, b"x")), RuntimeError, "without end"),
    ],
)
def test_mistakes_are_exceptions_that_name_them(
    changed: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        laws.values_were_sent(setup(**changed), Case())


def test_number_of_values_is_that_of_the_outputs() -> None:
    class Two(Ranger):
        def handle_frame(self, found: bytes) -> None:
            super().handle_frame(found)
            self.values = [1.0, 2.0]

    with pytest.raises(ValueError, match="`values` has 2 numbers, the outputs in `ports` have 1"):
        laws.recovers(setup(Two), Case())


@pytest.mark.parametrize(
    ("case", "error", "message"),
    [
        (Case(garbage=b""), ValueError, "garbage"),
        (Case(to_driver=[Damage(0, "wrong bit", 8)]), ValueError, "`wrong bit` of number 8"),
        (Case(to_driver=[Damage(0, "noise")]), ValueError, "`noise`"),  # type: ignore[arg-type]
        (Case(pieces=[256]), (TypeError, OverflowError), "pieces"),
    ],
)
def test_impossible_case_is_an_exception(
    case: Case, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        laws.recovers(setup(), case)


def test_objects_are_copied_and_several_devices_share_a_bus() -> None:
    second = type("Second", (Board,), {"name": "second", "ports": []})

    def ignore(_: Board, now: int, inputs: Any, outputs: Any) -> None:
        pass

    second.advance = ignore  # type: ignore[attr-defined]
    driver = Ranger()
    before = copy.deepcopy(vars(driver))
    both = setup(driver)
    both = laws.Setup(**{**vars(both), "devices": [Board(), second]})
    for law in (laws.values_were_sent, laws.restores_in_mid_frame, laws.recovers):
        law(both, Case())
    assert vars(driver) == before


def test_hypothesis_is_imported_by_need_only(monkeypatch: pytest.MonkeyPatch) -> None:
    program = "import sys, twinrig, twinrig.laws; print('hypothesis' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("False\n", "")
    monkeypatch.setitem(sys.modules, "hypothesis", None)
    needing: list[Callable[[], Any]] = [laws.cases, laws.config, lambda: laws.tests(setup())]
    for need in needing:
        with pytest.raises(ImportError, match="pip install hypothesis"):
            need()
