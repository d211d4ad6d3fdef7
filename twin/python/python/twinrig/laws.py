"""Laws of drivers: a serial driver and its emulated devices, in Python, checked from pytest.

The driver is sans-IO: bytes and times in, bytes and wake-up times out. Rust connects it to the
devices by a line in virtual time, damages the bytes on their way, and checks laws that hold for
every driver. Cases are drawn by Hypothesis, which finds a smallest one of those that fail.

>>> from twinrig import Output, laws
>>> setup = laws.Setup(
...     driver=Ranger, devices=[Board], byte_time="87 us", ports=[Output("distance", "m")]
... )
>>> TestRanger = laws.tests(setup)

All times that drivers and devices meet are whole nanoseconds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeAlias, Union

from twinrig import _native
from twinrig._parts import Floats, PartSource, Port

if TYPE_CHECKING:
    import hypothesis
    from hypothesis.strategies import SearchStrategy

__all__ = [
    "LAWS",
    "Case",
    "Damage",
    "Device",
    "Driver",
    "Setup",
    "Violation",
    "cases",
    "config",
    "cuts_change_nothing",
    "looks_change_nothing",
    "meets_the_deadline",
    "queues_stay_bounded",
    "recovers",
    "restores_in_mid_frame",
    "tests",
    "traffic_adds_up",
    "values_were_sent",
]


class Driver(Protocol):
    """The master side of a protocol; a class need not inherit from this one.

    After each call of `open`, `begin`, `close`, `handle_bytes` and `handle_timeout`, what
    `poll_transmit` returns is written until that is None, and `is_busy` tells whether the phase has
    ended. Optional are `period`, the nominal one of transfers, and ``save() -> bytes`` and
    ``restore(bytes)``. Without the latter two the state of the object are its attributes, which are
    pickled.
    """

    name: str
    ports: Sequence[Port]
    """Outputs are provided to the process, inputs are read from it."""
    values: Sequence[float]
    """Results of the last finished transfer: the outputs, one port after the other."""

    def open(self, now: int) -> None:
        """Begin to prepare the devices."""

    def begin(self, now: int, values: Sequence[float]) -> None:
        """Begin a transfer; `values` are the inputs, one port after the other."""

    def close(self, now: int) -> None:
        """Begin to put the devices into a safe state, from any phase."""

    def handle_bytes(self, now: int, data: bytes) -> None:
        """Process arbitrary bytes, in pieces of any length."""

    def handle_timeout(self, now: int) -> None:
        """Handle the time of `poll_timeout`, or do nothing if it is not reached."""

    def poll_timeout(self) -> int | None:
        """Return the time of the next `handle_timeout`."""

    def poll_transmit(self) -> bytes | None:
        """Return the next bytes to be written, and forget them."""

    def is_busy(self) -> bool:
        """Whether opening, the transfer or closing is still in progress.

        An `OSError`, such as `TimeoutError`, is the failure of the devices, which ends the run.
        """

    def traffic(self) -> tuple[int, int, int]:
        """Return the numbers of frames accepted, missing and discarded since the creation.

        Missing are time-outs and gaps in sequence numbers; discarded are frames and bytes that are
        damaged, unexpected or outside frames.
        """


class Device(Protocol):
    """An emulated board on the bus; a class need not inherit from this one.

    After each call of `receive` and `advance`, `next_wake` and `poll_transmit` are asked. Its state
    is that of a `Driver`.
    """

    name: str
    ports: Sequence[Port]
    """Inputs are outputs of the plant, which the device measures; outputs are what it drives."""

    def receive(self, first: int, spacing: int, data: bytes, framing_error: bool) -> None:
        """Receive bytes, which are complete at ``first``, ``first + spacing`` and so on.

        With `framing_error`, their stop bits are wrong.
        """

    def next_wake(self) -> int | None:
        """Return the time of the next `advance` that the device requires."""

    def advance(self, now: int, inputs: Floats, outputs: Floats) -> None:
        """Process all events up to and including `now`.

        `inputs` has the present values; `outputs` has those of the plant, and may be written. Both
        arrays are the same objects in every call.
        """

    def poll_transmit(self) -> tuple[int, bytes] | None:
        """Return the next transmission, and forget it: start of its first bit, and bytes.

        The start is now or later.
        """


Duration: TypeAlias = Union[str, int]
"""Text with a unit, as ``"87 us"``, or whole nanoseconds."""

Function: TypeAlias = Callable[[int, int], float]


@dataclass(frozen=True, kw_only=True)
class Setup:
    """A driver and its devices, the plant that these measure, and what the driver promises.

    Drivers and devices are made anew for each run: by a class or a function without arguments, or
    as deep copies of an object. Mistakes are exceptions of the constructor.
    """

    driver: PartSource
    """Class of the `Driver`, or a function that returns one."""
    devices: Sequence[PartSource]
    """Classes of the `Device` objects, or functions: one on a line of its own, several on a bus."""
    byte_time: Duration
    """Time that a byte takes on the line."""
    ports: Sequence[Port]
    """Ports of the plant: an `Output` for each `Input` of a device, and the other way round."""
    levels: Function | None = None
    """Outputs of the plant, by level and component. A level lasts three periods, and each must have
    another value, as the driver reports it. By default ``0.01 * level + 0.001 * component``."""
    commands: Function | None = None
    """Inputs of the driver, by number of the transfer and component; by default 0."""
    period: Duration | None = None
    """From one transfer to the next; by default that of the driver, or 10 ms."""
    recovery: int | None = None
    """Periods within which the driver recovers after the last damage; by default 2."""
    deadline: Duration | None = None
    """Time within which opening and closing each end; by default 1 s."""
    transfer_deadline: Duration | None = None
    """Time within which a transfer ends; by default two periods."""
    state_bytes: int | None = None
    """Growth of the saved state of driver and devices; by default 4096 bytes."""
    detection: Literal["all damage", "wrong bits"] = "all damage"
    """What the checksum detects: ``all damage`` as a CRC of 16 bits does, or ``wrong bits``, but no
    shifted bytes, as a sum."""
    spacing: int | None = None
    """Least number of bytes between two damages that the checksum detects; by default 0."""
    numbered_answers: bool = False
    """Whether the driver recognises an answer that comes again by a number in it."""
    foreign_frames: Sequence[bytes] = ()
    """Frames that the driver ignores: of other addresses, kinds and directions."""

    def __post_init__(self) -> None:
        _native.check_setup(self)


@dataclass(frozen=True)
class Damage:
    """Damage to a stream of bytes."""

    after: int
    """Number of intact bytes before it."""
    kind: Literal["wrong bit", "loss", "double byte", "insertion", "delay", "frame"]
    number: int = 0
    """Of the bit, of bytes lost, of the inserted byte, of the delay [1/1000 period], of the frame:
    a foreign or an old one comes before the next transmission."""


@dataclass(frozen=True)
class Case:
    """What happens to the course of a run. Each law uses the part that concerns it."""

    to_driver: Sequence[Damage] = ()
    """Damage to the bytes on their way to the driver."""
    to_devices: Sequence[Damage] = ()
    pieces: Sequence[int] = (1,)
    """Lengths of the pieces into which streams are cut, in turn [bytes]."""
    looks: Sequence[int] = (100,)
    """Times between two looks, in turn [1/1000 period]."""
    saved: int = 1
    """Number of the transmission within which the state is saved."""
    saved_at: int = 500
    """Place within this transmission [1/1000]."""
    garbage: bytes = b"\0"


class Violation(AssertionError):
    """A law that does not hold."""

    def __init__(self, law: str, at: int, what: str) -> None:
        super().__init__(law, at, what)
        self.law = law
        """Name of the law: that of its function."""
        self.at = at
        """Instant at which it is seen [ns]."""
        self.what = what
        """What was found, with the values."""

    def __str__(self) -> str:
        return f"{self.law} is violated at {self.at / 1e6} ms: {self.what}"


def _check(law: str, setup: Setup, case: Case) -> None:
    __tracebackhide__ = True  # Of pytest.
    found = _native.check_law(law, setup, case)
    if found is not None:
        raise Violation(law, *found)


def values_were_sent(setup: Setup, case: Case) -> None:
    """No value is accepted that was not sent, and none older than the last one."""
    _check("values_were_sent", setup, case)


def traffic_adds_up(setup: Setup, case: Case) -> None:
    """Nothing is lost, doubled or made up beyond the counters."""
    _check("traffic_adds_up", setup, case)


def cuts_change_nothing(setup: Setup, case: Case) -> None:
    """The pieces in which a stream is received have no effect."""
    _check("cuts_change_nothing", setup, case)


def looks_change_nothing(setup: Setup, case: Case) -> None:
    """Calls more often than necessary have no effect."""
    _check("looks_change_nothing", setup, case)


def restores_in_mid_frame(setup: Setup, case: Case) -> None:
    """A state saved anywhere continues as the original does."""
    _check("restores_in_mid_frame", setup, case)


def recovers(setup: Setup, case: Case) -> None:
    """Some periods after the last damage everything is as if it had never been."""
    _check("recovers", setup, case)


def queues_stay_bounded(setup: Setup, case: Case) -> None:
    """Neither states nor transmissions grow under a flood."""
    _check("queues_stay_bounded", setup, case)


def meets_the_deadline(setup: Setup, case: Case) -> None:
    """Opening, transfers and closing end, whatever is on the line."""
    _check("meets_the_deadline", setup, case)


Law: TypeAlias = Callable[[Setup, Case], None]

LAWS: tuple[Law, ...] = (
    values_were_sent,
    traffic_adds_up,
    cuts_change_nothing,
    looks_change_nothing,
    restores_in_mid_frame,
    recovers,
    queues_stay_bounded,
    meets_the_deadline,
)
"""All laws: functions of a setup and a case that raise a `Violation`."""


def _require_hypothesis() -> None:
    try:
        import hypothesis  # noqa: F401
    except ImportError as error:
        raise ImportError(
            "twinrig.laws draws its cases by the package hypothesis: pip install hypothesis"
        ) from error


def config(**changed: Any) -> hypothesis.settings:
    """Return settings of Hypothesis for laws, of which some may be changed.

    There are 24 cases, without Hypothesis's deadline, and without the phase ``explain``, which
    takes ten times as long as to find a smallest case.
    """
    _require_hypothesis()
    from hypothesis import Phase, settings

    phases = [phase for phase in Phase if phase is not Phase.explain]
    return settings(**{"max_examples": 24, "deadline": None, "phases": phases, **changed})


def cases() -> SearchStrategy[Case]:
    """Return the strategy of the cases of all laws, for ``hypothesis.given``."""
    _require_hypothesis()
    from hypothesis import strategies as st

    ranges = _native.case_ranges()

    def damages(length: tuple[int, int], kinds: Iterable[Any]) -> SearchStrategy[list[Damage]]:
        # Hypothesis has no weights: a kind comes as often as it weighs.
        kinds = [(kind, number) for kind, weight, number in kinds for _ in range(weight)]
        damage = st.sampled_from(kinds).flatmap(
            lambda drawn: st.builds(
                Damage,
                after=st.integers(*ranges["after"]),
                kind=st.just(drawn[0]),
                number=st.integers(*drawn[1]),
            )
        )
        return st.lists(damage, min_size=length[0], max_size=length[1])

    def numbers(of: tuple[tuple[int, int], tuple[int, int]]) -> SearchStrategy[list[int]]:
        length, number = of
        return st.lists(st.integers(*number), min_size=length[0], max_size=length[1])

    kinds = ranges["kinds"]
    return st.builds(
        Case,
        to_driver=damages(ranges["to_driver"], ((k, w, n) for k, w, _, n in kinds)),
        to_devices=damages(ranges["to_devices"], ((k, w, n) for k, w, both, n in kinds if both)),
        pieces=numbers(ranges["pieces"]),
        looks=numbers(ranges["looks"]),
        saved=st.integers(*ranges["saved"]),
        saved_at=st.integers(*ranges["saved_at"]),
        garbage=numbers(ranges["garbage"]).map(bytes),
    )


def tests(
    setup: Setup, laws: Iterable[Law] = LAWS, *, settings: hypothesis.settings | None = None
) -> type[Any]:
    """Return a class with a test for each law, which pytest collects by a name ``Test…``.

    Parameters
    ----------
    setup
        The driver and its devices.
    laws
        Some of the laws, where a protocol cannot obey all.
    settings
        Of Hypothesis; by default those of `config`.
    """
    applied = settings or config()
    from hypothesis import given

    def test(law: Law) -> Any:
        def method(self: object, case: Case) -> None:
            law(setup, case)

        # Hypothesis keeps the failures of a test by its name.
        method.__name__ = f"test_{law.__name__}"
        method.__qualname__ = f"laws.{method.__name__}"
        method.__doc__ = law.__doc__
        return applied(given(case=cases())(method))

    methods = {f"test_{law.__name__}": test(law) for law in laws}
    return type("TestLaws", (), methods)


# Where the function itself is imported, pytest does not take it for a test.
tests.__test__ = False  # type: ignore[attr-defined]
