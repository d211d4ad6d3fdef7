"""Many runs in one call: from saved states, under commands given in advance."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from twinrig import _native
from twinrig._layouts import matching
from twinrig._parts import Floats, PartSource
from twinrig._rig import Rig, Workers
from twinrig._scenario import Scenario
from twinrig._signal import unknown


@dataclass(frozen=True)
class LaneError:
    """Failure of one run of a rollout."""

    lane: int
    """Number of the run."""
    step: int
    """Number of the step that failed, or of all steps if its state could not be saved."""
    time: float
    """Simulated time of the failure [s]; NaN if the run has not begun."""
    error: BaseException
    """Reason: what a `Rig` raises at the same call."""

    def __str__(self) -> str:
        return f"lane {self.lane}, step {self.step} at {self.time:.6g} s: {self.error}"


class Trajectories(Mapping[str, Floats]):
    """Results of a rollout of N runs and T steps, at the ends of the steps.

    ``trajectories["body/position"]`` is a view of `matrix`: shape ``(N, T)``, or ``(N, T, size)``
    for a vector. Of a run that failed, the rows from that step on are NaN, and false in
    `has_fallen`.
    """

    matrix: Floats
    """All signals one after the other, in their units, shape ``(N, T, width)``."""
    time: Floats
    """Simulated time [s], shape ``(N, T)``."""
    has_fallen: npt.NDArray[np.bool_]
    """Whether the robot is on the ground, as `Rig.has_fallen`, shape ``(N, T)``."""
    states: list[bytes | None]
    """State of each run at its end, as `Rig.save`; ``None`` of a run that failed."""
    errors: list[LaneError]
    """Failures of runs, in their order."""

    def __init__(
        self,
        slices: Mapping[str, Any],
        matrix: Floats,
        time: Floats,
        has_fallen: npt.NDArray[np.bool_],
        states: list[bytes | None],
        errors: list[LaneError],
    ) -> None:
        self._slices = slices
        self.matrix, self.time, self.has_fallen = matrix, time, has_fallen
        self.states, self.errors = states, errors

    def __getitem__(self, name: str) -> Floats:
        if name not in self._slices:
            unknown(name, self._slices)
        found: Floats = self.matrix[..., self._slices[name]]
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self._slices)

    def __len__(self) -> int:
        return len(self._slices)

    def __repr__(self) -> str:
        lanes, steps, _ = self.matrix.shape
        failed = f", {len(self.errors)} failed" if self.errors else ""
        return f"<twinrig.Trajectories: {lanes} runs, {steps} steps{failed}>"


class Rollout:
    """Rigs and threads for rollouts of a scenario, which many calls of `run` use.

    Parameters
    ----------
    scenario, set, plant, seed, controllers, plants, fingerprint
        As of `twinrig.Rig`.
    signals
        Signals of the results; ``*`` is a part of a name and ``**`` several.
    step
        Duration of a step [s], to the nanosecond; a control period by default.
    threads
        Number of threads; by default one a core.
    """

    def __init__(
        self,
        scenario: Scenario,
        signals: Iterable[str],
        *,
        step: float | None = None,
        set: Mapping[str, Any] | None = None,
        plant: str | None = None,
        seed: int | None = None,
        controllers: Mapping[str, PartSource] | None = None,
        plants: Mapping[str, PartSource] | None = None,
        fingerprint: bool = True,
        threads: int | None = None,
    ) -> None:
        common = dict(set or {})

        def build(settings: Mapping[str, Any]) -> Rig:
            return Rig(
                scenario,
                set={**common, **settings},
                plant=plant,
                seed=seed,
                controllers=controllers,
                plants=plants,
                fingerprint=fingerprint,
            )

        rig = build({})
        self._build, self._start = build, rig.save()
        self._rigs: list[_native.Rig] = [rig]
        self._workers = Workers(threads)
        self._sizes = {name: size for name, _, size in rig.signals()}
        self._variables = {name for name, *_ in rig.variables()}
        self._step = rig.period if step is None else step
        self._names: list[str] = []
        self._slices: dict[str, int | slice] = {}
        self._width = 0
        if isinstance(signals, str):
            raise TypeError("signals: expected a list of names, not str")
        for pattern in signals:
            found = matching(pattern, list(self._sizes))
            if not found:
                raise ValueError(f"signals: no signal of the scenario matches `{pattern}`")
            for name in found:
                if name not in self._slices:
                    self._add(rig, name)

    def _add(self, rig: Rig, name: str) -> None:
        size, start = len(rig.read(name)), self._width
        self._names.append(name)
        self._slices[name] = start if size == 1 else slice(start, start + size)
        self._width += size

    def run(
        self,
        states: bytes | Sequence[bytes] | None,
        commands: Mapping[str, npt.ArrayLike],
        *,
        set: Mapping[str, npt.NDArray[Any]] | None = None,
        steps: int | None = None,
    ) -> Trajectories:
        """Run N lanes for T steps.

        Parameters
        ----------
        states
            State in which each lane begins, as of `Rig.save` or `Trajectories.states`; one for all;
            or ``None``: the start of the scenario.
        commands
            Arrays by names of process variables and of outputs of the controller, with a value for
            each step of each lane: shape ``(N, T)``, or ``(N, T, size)`` for a vector. A step
            begins as with `Rig.set_variable` and `Rig.write`.
        set
            Arrays with a value for each lane. The name of a process variable (``frequency``) sets
            it as `Rig.set_variable` before the first step. Any other name is a key of the scenario
            (``plant.ground.friction``), for which the rig of each lane is built; a state then has
            to be one of a rig with the same settings.
        steps
            Number of steps, for rollouts without commands.
        """
        common, given = None, None
        if isinstance(states, bytes):
            common = states
        elif states is not None:
            given = list(states)
        arrays = {name: np.asarray(values, np.float64) for name, values in commands.items()}
        varied = {name: _varied(name, values) for name, values in (set or {}).items()}
        counts = {name: array.shape[:2] for name, array in arrays.items()}
        for name, shape in counts.items():
            if len(shape) < 2:
                raise ValueError(f"commands[{name!r}]: expected the shape (N, T), not {shape}")
        lanes = _agreed(
            "lanes",
            ([] if given is None else [("states", len(given))])
            + [(f"commands[{name!r}]", shape[0]) for name, shape in counts.items()]
            + [(f"set[{name!r}]", len(values)) for name, values in varied.items()],
        )
        length = _agreed(
            "steps",
            ([] if steps is None else [("steps", steps)])
            + [(f"commands[{name!r}]", shape[1]) for name, shape in counts.items()],
        )
        if length < 0:
            raise ValueError(f"steps: expected at least 0, not {length}")
        columns = []
        for name, array in arrays.items():
            size = 1 if name in self._variables else self._sizes.get(name, 1)
            if array.shape not in ((lanes, length, size), (lanes, length)[: 2 if size == 1 else 0]):
                raise ValueError(
                    f"commands[{name!r}]: expected the shape {(lanes, length, size)}, "
                    f"not {array.shape}"
                )
            columns.append(array.reshape(lanes, length, size))
        variables = [
            (name, np.asarray(values, np.float64).tolist())
            for name, values in varied.items()
            if name in self._variables
        ]
        keys = [name for name in varied if name not in self._variables]
        if states is None and not keys:
            common = self._start
        begins: Sequence[bytes | None] = [common] * lanes if given is None else given

        def build(lane: int) -> Rig:
            return self._build({key: varied[key][lane].tolist() for key in keys})

        # Another thread that calls meanwhile finds no rigs, and builds its own.
        rigs, self._rigs = self._rigs, []
        matrix, time, has_fallen, ends, failures, self._rigs = _native.rollout(
            rigs,
            not keys,
            build,
            (list(arrays), self._names),
            begins,
            variables,
            np.concatenate(columns, axis=2).ravel() if columns else np.empty(0),
            (length, self._width),
            self._step,
            self._workers,
        )
        return Trajectories(
            self._slices,
            matrix.reshape((lanes, length, self._width)),
            time.reshape((lanes, length)),
            has_fallen.reshape((lanes, length)),
            ends,
            [LaneError(lane, *failure) for lane, failure in enumerate(failures) if failure],
        )


def _varied(name: str, values: object) -> npt.NDArray[Any]:
    """Return the values of a setting of each lane."""
    if not isinstance(values, np.ndarray) or values.ndim == 0:
        raise TypeError(
            f"set[{name!r}]: expected an array with a value for each lane, "
            f"not {type(values).__name__}"
        )
    return values


def _agreed(of: str, counts: Sequence[tuple[str, int]]) -> int:
    """Return the number that all arguments have."""
    if not counts:
        raise ValueError(f"the number of {of} follows from no argument")
    (first, count), *others = counts
    for name, other in others:
        if other != count:
            raise ValueError(f"{name} has {other} {of}, {first} has {count}")
    return count


def rollout(
    scenario: Scenario,
    states: bytes | Sequence[bytes] | None,
    commands: Mapping[str, npt.ArrayLike],
    signals: Iterable[str],
    *,
    step: float | None = None,
    steps: int | None = None,
    set: Mapping[str, Any] | None = None,
    plant: str | None = None,
    seed: int | None = None,
    controllers: Mapping[str, PartSource] | None = None,
    plants: Mapping[str, PartSource] | None = None,
    fingerprint: bool = True,
    threads: int | None = None,
) -> Trajectories:
    """Run a scenario N times for T steps, on all cores, without Python in between.

    >>> commands = {"frequency": np.linspace(3.0, 3.7, 8)[:, None].repeat(500, axis=1)}
    >>> found = twinrig.rollout("scenarios/trot.toml", None, commands, ["body/position"])
    >>> found["body/position"].shape
    (8, 500, 3)

    Every run is that of a `twinrig.Rig` with the same state, commands and settings, bit for bit and
    for every number of threads; a run that fails has no effect on the others. Ctrl-C ends the call.

    `states`, `commands` and `steps` are those of `Rollout.run`, the others of `Rollout`. An array
    in `set` has a value for each lane, other values of `set` are common. `Rollout` keeps rigs and
    threads for further calls.
    """
    settings = dict(set or {})
    varied = {name: value for name, value in settings.items() if isinstance(value, np.ndarray)}
    prepared = Rollout(
        scenario,
        signals,
        step=step,
        set={name: value for name, value in settings.items() if name not in varied},
        plant=plant,
        seed=seed,
        controllers=controllers,
        plants=plants,
        fingerprint=fingerprint,
        threads=threads,
    )
    return prepared.run(states, commands, set=varied, steps=steps)
