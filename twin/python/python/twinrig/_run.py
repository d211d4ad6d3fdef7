"""Results of runs, in memory or read from a recording."""

from __future__ import annotations

import html
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from twinrig._frames import Frame, frames
from twinrig._html import table
from twinrig._signal import Floats, SignalGroup, Signals, frozen


@dataclass(frozen=True)
class Expectation:
    """Outcome of an expectation. Numbers are in `unit`, or ``None`` if nothing was measured."""

    name: str
    verdict: str
    """``pass``, ``fail`` or ``unobserved``."""
    measured: float | None
    """Value next to a violation."""
    bound: float | None
    """Limit next to it."""
    other_bound: float | None
    """Opposite limit, if there are two."""
    margin: float | None
    """Distance to the limit, negative beyond it."""
    unit: str
    first_violation_s: float | None
    """Time of the first violation [s]."""
    optional: bool
    """Whether it holds if it is unobserved."""
    detail: str
    """Leg and footstep concerned, or the reason for ``unobserved``; may be empty."""
    leg: str | None = None
    """Leg of the measured value."""
    signal: str | None = None
    """Signal of the measured value."""
    element: int | None = None
    """Element of a signal with several, counted from 0."""
    instant_s: float | None = None
    """Instant of the measured value [s]; of a footstep its touch-down."""
    recording_s: float | None = None
    """The same instant on the time line of recordings [s]."""
    value: float | None = None
    """Value of the signal at the instant."""
    min: float | None = None
    """Least accepted value."""
    max: float | None = None
    """Greatest accepted value."""
    file: str | None = None
    """File of the expectation; ``None`` in recordings, which contain the scenario itself."""
    line: int | None = None
    """Line in it, counted from 1."""
    cut_short: bool = False
    """Whether it is unobserved in a run that an error ended before its time window."""
    ensemble: dict[str, Any] | None = None
    """Share and margins over the runs of the scenario's ensemble, as in ``twin run --json``."""

    @property
    def holds(self) -> bool:
        """Whether the run may pass with this outcome, and with that of the ensemble."""
        if self.ensemble is not None and self.ensemble["share"] < self.ensemble["required_share"]:
            return False
        return self.verdict == "pass" or (self.verdict == "unobserved" and self.optional)


@dataclass(frozen=True)
class Page:
    """A page that has been written, which a notebook shows."""

    path: Path

    def _repr_html_(self) -> str:
        text = html.escape(self.path.read_text(encoding="utf-8"))
        style = "width: 100%; height: 800px; border: 0"
        return f'<iframe srcdoc="{text}" style="{style}"></iframe>'


@dataclass(frozen=True)
class Energy:
    """Energy balance of the plant [J]."""

    residual_j: float
    exchanged_j: float
    """Sum of the magnitudes of all transfers."""
    actuator_j: float
    """Work of the actuators."""
    dissipated_j: float
    """By friction and damping."""
    impact_j: float
    """By impacts."""


FOOTSTEP_NUMBERS = np.dtype(
    [
        ("touch_down_s", "f8"),
        ("lift_off_s", "f8"),
        ("position_m", "f8", (3,)),
        ("slip_m", "f8"),
        ("impulse_ns", "f8"),
        ("peak_load_n", "f8"),
    ]
)


def _footsteps(legs: list[str], leg: npt.NDArray[np.int64], numbers: Floats) -> npt.NDArray[Any]:
    longest = max((len(name) for name in legs), default=1)
    array = np.empty(len(leg), dtype=[("leg", f"U{longest}"), *FOOTSTEP_NUMBERS.descr])
    if len(leg):
        array["leg"] = np.array(legs)[leg]
    rows = numbers.view(FOOTSTEP_NUMBERS)
    for field in FOOTSTEP_NUMBERS.names or ():
        array[field] = rows[field]
    return frozen(array)


class Results:
    """What a run and a recording have in common: an ordinary object, which can be pickled."""

    signals: Signals
    """Signals by name; arrays without a copy."""
    footsteps: npt.NDArray[Any]
    """Completed footsteps in the order of their ends, a structured array: `leg`, `touch_down_s` and
    `lift_off_s` [s], `position_m` at touch-down (x, y, z in the world) [m], `slip_m` [m],
    `impulse_ns` [N·s], `peak_load_n` [N]."""
    expectations: list[Expectation]
    verdict: str
    """``pass`` if all expectations hold, ``fail``, or ``error`` if the run did not complete."""
    fingerprint: str
    """Hash of all samples and events, 64 digits: equal runs have equal ones."""
    seed: int
    error: str | None
    """Error that ended the run before its end."""

    def __init__(self, raw: dict[str, Any]) -> None:
        groups = [
            SignalGroup(name, rows, time, values) for name, rows, time, values in raw["groups"]
        ]
        self.signals = Signals(groups)
        self.footsteps = _footsteps(*raw["footsteps"])
        self._frames: tuple[list[tuple[str, str]], Floats, Floats] = raw["frames"]

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        frozen(self.footsteps)

    def frames(self, *, in_parents: bool = False) -> dict[str, Frame]:
        """Return the coordinate frames of trunk and leg segments over time, by name.

        They are in the world, or with `in_parents` each in its parent, as in the topic ``/tf`` of
        recordings; their times are those of ``[record] frames``, 50 Hz by default.
        """
        links, time, numbers = self._frames
        return frames(links, time, numbers, in_parents=in_parents)

    def _counts(self) -> str:
        held = sum(expectation.holds for expectation in self.expectations)
        return f"{held} of {len(self.expectations)} expectations hold"


class Run(Results):
    """A run that has ended: signals, footsteps and verdict. `print` shows the program's table."""

    report: dict[str, Any]
    """The object that ``twin run --json`` prints."""
    energy: Energy | None
    """Energy balance; ``None`` after a panic of a part."""
    recording: Path | None
    """Path of the recording."""
    buses: list[dict[str, Any]]
    """Traffic of each bus, with the keys of ``buses`` in ``twin run --json``."""

    def __init__(self, raw: dict[str, Any]) -> None:
        super().__init__(raw)
        self.report = json.loads(raw["report"])
        self._table: str = raw["table"]
        report = self.report
        self.verdict, self.error = report["verdict"], report["error"]
        self.buses = report["buses"]
        self.fingerprint, self.seed = report["fingerprint"], report["seed"]
        self.expectations = [Expectation(**line) for line in report["expectations"]]
        self.energy = None if report["energy"] is None else Energy(**report["energy"])
        self.recording = None if report["recording"] is None else Path(report["recording"])

    def __str__(self) -> str:
        return self._table

    def __repr__(self) -> str:
        name, print_ = self.report["scenario"], self.fingerprint[:16]
        return (
            f"<Run {name!r}: {self.verdict}, {self._counts()}, seed {self.seed}, "
            f"fingerprint {print_}…>"
        )

    def _repr_html_(self) -> str:
        return f'<pre style="line-height: 1.2">{html.escape(self._table)}</pre>'


class Recording(Results):
    """A recording that was read into memory."""

    path: Path
    is_complete: bool
    """Whether the file was closed; otherwise its run was killed, or still goes on."""
    is_interrupted: bool
    """Whether the user ended the run before its end."""
    notes: dict[str, str]
    """Metadata: ``scenario``, ``plant``, ``build``, ``settings`` and others."""
    files: dict[str, bytes]
    """Input files of the run: ``scenario.toml``, ``robot.toml`` and others."""
    reached_s: float | None
    """Simulated time that the run reached [s]; ``None`` if it is not complete."""

    def __init__(self, path: str, raw: dict[str, Any]) -> None:
        super().__init__(raw)
        self.path = Path(path)
        verdict = json.loads(raw["verdict"]) if raw["verdict"] else {}
        self.verdict = verdict.get("verdict", "error")
        self.error = verdict.get("error")
        self.is_complete = raw["complete"]
        self.is_interrupted = verdict.get("interrupted", not self.is_complete)
        self.expectations = [Expectation(**line) for line in verdict.get("expectations", [])]
        # A recording without its end has no fingerprint.
        self.fingerprint, self.seed = raw["fingerprint"] or "", raw["seed"] or 0
        self.notes, self.files = dict(raw["notes"]), dict(raw["files"])
        self.reached_s = raw["reached_s"]

    def __repr__(self) -> str:
        return f"<Recording {str(self.path)!r}: {self.verdict}, {self._counts()}>"

    def _repr_html_(self) -> str:
        rows = (
            (each.name, each.verdict, each.measured, each.bound, each.margin, each.unit)
            for each in self.expectations
        )
        head = ("expectation", "verdict", "measured", "bound", "margin", "unit")
        return table(f"{self.path}: {self.verdict}, {self._counts()}", head, rows)
