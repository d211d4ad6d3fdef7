"""The stepped interface."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from twinrig import _native
from twinrig._html import table
from twinrig._parts import Floats, PartSource, sources
from twinrig._scenario import Scenario, native


class Rig(_native.Rig):
    """A scenario as a rig that is advanced step by step.

    >>> with twinrig.Rig("scenarios/trot.toml") as rig:
    ...     rig.step(until=1.0)
    ...     height = rig.read("body/position")[2]
    ...     rig.set_variable("frequency", 3.2)
    ...     rig.step()
    1.0
    1.002

    It starts at time 0, with the events of time 0 done: the first control step and observation.
    Expectations are not judged; scheduled changes and faults of the scenario happen. It ends with
    the scenario: a step past its `duration` is refused.

    A rig is used by one call at a time, and by the process that made it; it cannot be pickled, but
    its saved state is `bytes`.

    Parameters
    ----------
    scenario, set, plant, seed, signals
        As of `twinrig.run`. `signals` are the outputs of the plant that are computed.
    controllers, plants
        Controllers and plants in Python by the names under which the scenario refers to them, as
        ``kind`` of ``[controller]`` and ``model`` of ``[plant]``: classes, functions or objects,
        see `twinrig.Controller` and `twinrig.Plant`.
    fingerprint
        Whether samples and events are hashed for `fingerprint`, which takes a seventh of a run of
        the trot. A rig that hashes continues the fingerprint of a restored state, if it has one.
    """

    def __new__(
        cls,
        scenario: Scenario,
        *,
        set: Mapping[str, Any] | None = None,
        plant: str | None = None,
        seed: int | None = None,
        signals: Iterable[str] | None = None,
        controllers: Mapping[str, PartSource] | None = None,
        plants: Mapping[str, PartSource] | None = None,
        fingerprint: bool = True,
    ) -> Rig:
        arguments = native(scenario, set=set, plant=plant, seed=seed, signals=signals)
        rig = super().__new__(
            cls,
            arguments,
            sources(controllers, "controllers"),
            sources(plants, "plants"),
            fingerprint,
        )
        rig._name = arguments[0]
        return rig

    _name: str

    @property
    def units(self) -> dict[str, str]:
        """Unit of each signal, by name."""
        return {name: unit for name, unit, _ in self.signals()}

    def read_all(self) -> dict[str, Floats]:
        """Return the newest values of every signal, by name."""
        return {name: self.read(name) for name, _, _ in self.signals()}

    def write(self, name: str, values: npt.ArrayLike | None) -> None:
        """Replace an output of the controller from its next control step on.

        Parameters
        ----------
        name
            Signal of the controller: ``leg/LF/hip/command``.
        values
            Values in the unit of the signal, shape ``(size,)``, or a number for a signal of size
            1; ``None`` ends the replacement. Angles of joints are at most 100 rad.
        """
        if values is None:
            super().write(name, None)
            return
        array = np.asarray(values)
        if array.dtype.kind not in "fiu":
            raise TypeError(f"values: expected real numbers, not {array.dtype}")
        flat = np.atleast_1d(array).astype(np.float64)
        if flat.ndim != 1:
            raise ValueError(f"values: expected the shape (size,), not {array.shape}")
        super().write(name, flat)

    def __enter__(self) -> Rig:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        exception: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __reduce__(self) -> Any:
        raise TypeError("a rig cannot be pickled: pickle the state that its method `save` returns")

    def __repr__(self) -> str:
        try:
            return f"<twinrig.Rig {self._name!r} at {self.now:.6g} s>"
        except (ValueError, RuntimeError) as error:
            return f"<twinrig.Rig {self._name!r}: {error}>"

    def _repr_html_(self) -> str:
        try:
            rows = [(name, value, unit) for name, unit, value, _, _ in self.variables()]
        except (ValueError, RuntimeError):
            rows = []
        return table(repr(self)[1:-1], ("variable", "value", "unit"), rows)


class Workers(_native.Workers):
    """Threads that advance rigs, started once for many calls of `step_all`.

    After a fork the threads are those of the parent process: there, the caller's thread does their
    work.

    Parameters
    ----------
    threads
        Number of threads with that of the caller; by default one a core.
    """

    def __new__(cls, threads: int | None = None) -> Workers:
        return super().__new__(cls, threads if threads is not None else (os.cpu_count() or 1))


def step_all(
    rigs: Sequence[Rig],
    duration: float,
    *,
    threads: int | None = None,
    workers: Workers | None = None,
) -> list[BaseException | None]:
    """Advance every rig by `duration` [s], or to the end of its scenario, on all cores.

    Returns the exception of each, or ``None``; an exception of one has no effect on the others.
    Results do not depend on the number of threads, which are those of `workers`, or are started for
    this call. An exception of a signal handler, such as `KeyboardInterrupt`, ends a step of more
    than 100 ms; all rigs without an exception of their own have then advanced by the same time.
    """
    return _native.step_all(list(rigs), duration, workers or Workers(threads))
