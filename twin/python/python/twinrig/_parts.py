"""Parts of a rig written in Python: their ports and variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol, TypeAlias, Union

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]

Channels: TypeAlias = tuple[Sequence[str], Sequence[str]]
"""Variables and outputs of a controller that are commanded, and signals that are read."""

LaneFailure: TypeAlias = tuple[int, float, BaseException]
"""Step, time [s] and reason of the failure of one rig among several."""


@dataclass(frozen=True)
class Input:
    """An input of a part: a signal that it reads."""

    name: str
    unit: str
    """Symbol, as ``twin list`` shows it: ``rad``, ``N``, ``1`` for a number without unit."""
    size: int = 1
    direction: ClassVar[str] = "input"


@dataclass(frozen=True)
class Output:
    """An output of a part: a signal that it writes."""

    name: str
    unit: str
    size: int = 1
    direction: ClassVar[str] = "output"


Port: TypeAlias = Union[Input, Output]


@dataclass(frozen=True)
class Variable:
    """A process variable of a controller, which scenarios set and change by its name."""

    name: str
    unit: str
    default: float
    min: float | None = field(default=None, kw_only=True)
    max: float | None = field(default=None, kw_only=True)


class Controller(Protocol):
    """A controller in Python; a class need not inherit from this one.

    Optional are `variables`, a list of `Variable` whose values are set as attributes (or by a
    method ``set_variable(name, value)``), and ``save() -> bytes`` and ``restore(bytes)``. Without
    the latter two the state of the object are its attributes, which are pickled.
    """

    ports: Sequence[Port]

    def step(self, elapsed: float, inputs: Floats, outputs: Floats) -> None:
        """Run one iteration.

        Parameters
        ----------
        elapsed
            Time since the last iteration [s]; 0 at the first.
        inputs
            Values of the inputs, one port after the other, shape ``(n,)``.
        outputs
            Array for the values of the outputs, shape ``(m,)``; it has those of the last
            iteration. Both arrays are the same objects in every call.
        """


class Plant(Protocol):
    """A plant in Python; a class need not inherit from this one.

    Optional are ``save() -> bytes`` and ``restore(bytes)``, as of a `Controller`.
    """

    ports: Sequence[Port]

    def advance(self, to: float, inputs: Floats) -> None:
        """Advance to the time `to` [s] under constant inputs."""

    def observe(self, outputs: Floats) -> None:
        """Write the outputs at the time advanced to; the state must not change."""


PartSource: TypeAlias = Any
"""A class or function that is called for every rig, or an object that is copied for each."""


def sources(given: Mapping[str, PartSource] | None, argument: str) -> dict[str, PartSource]:
    """Return the argument `controllers` or `plants` as a dictionary."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise TypeError(f"{argument}: expected a dictionary, not {type(given).__name__}")
    for name in given:
        if not isinstance(name, str):
            raise TypeError(f"{argument}: a name must be a string, not {type(name).__name__}")
    return dict(given)
