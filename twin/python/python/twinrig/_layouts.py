"""Observations, signals and actions of an environment: their names, limits and arrays."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias, Union

import numpy as np
import numpy.typing as npt

from twinrig._parts import Floats
from twinrig._rig import Rig

Limits: TypeAlias = tuple[npt.ArrayLike, npt.ArrayLike]
"""Least and greatest value."""

Names: TypeAlias = Union[Sequence[str], Mapping[str, Union[Limits, None]]]
"""Names, with limits where they are keys of a dictionary."""

ROUNDING = 2.0**-22
"""Excess of a value over its limit, relative to it, that rounding to 32 bits explains."""


def _limits(values: Limits, size: int, place: str) -> tuple[Floats, Floats]:
    """Return limits as arrays of the shape ``(size,)``."""
    try:
        low, high = (np.asarray(value, np.float64) for value in values)
        pair = np.broadcast_to(low, (size,)), np.broadcast_to(high, (size,))
    except (TypeError, ValueError):
        raise ValueError(
            f"{place}: expected the least and the greatest value, numbers or arrays of {size}, "
            f"not {values!r}"
        ) from None
    if not (pair[0] < pair[1]).all():
        raise ValueError(f"{place}: the least value must be below the greatest, not {values!r}")
    return pair


def _named(names: Names, argument: str) -> list[tuple[str, Limits | None]]:
    """Return names and limits of an argument."""
    if isinstance(names, str) or not isinstance(names, (Sequence, Mapping)):
        raise TypeError(
            f"{argument}: expected a list of names or a dictionary, not {type(names).__name__}"
        )
    for name in names:
        if not isinstance(name, str):
            raise TypeError(f"{argument}: a name must be a string, not {type(name).__name__}")
    return [(name, names[name] if isinstance(names, Mapping) else None) for name in names]


def matching(pattern: str, known: Sequence[str]) -> list[str]:
    """Return the names that a pattern stands for; a name without ``*`` stands for itself."""
    if "*" not in pattern:
        return [pattern]
    parts = re.split(r"(\*\*?)", pattern)
    rules = {"*": "[^/]*", "**": ".*"}
    rule = re.compile("".join(rules.get(part) or re.escape(part) for part in parts))
    return [name for name in known if rule.fullmatch(name)]


class SignalLayout:
    """Signals that an environment reads: observations, and others for reward and `info`."""

    def __init__(self, rig: Rig, observations: Names, signals: Sequence[str]) -> None:
        sizes = {name: size for name, _, size in rig.signals()}
        limits: dict[str, Limits | None] = {}
        for pattern, given in _named(observations, "observations"):
            limits |= dict.fromkeys(self._found(rig, sizes, pattern, "observations"), given)
        if not limits:
            raise ValueError("observations: expected at least one signal")
        low, high = [], []
        for name, given in limits.items():
            size, place = sizes[name], f"observations[{name!r}]"
            bounds = _limits(given or (-np.inf, np.inf), size, place)
            low.append(bounds[0])
            high.append(bounds[1])
        self.low, self.high = np.concatenate(low), np.concatenate(high)
        self.shown: list[str] = []
        for pattern, _ in _named(signals, "signals"):
            self.shown += self._found(rig, sizes, pattern, "signals")
        self.names = list(dict.fromkeys([*limits, *self.shown]))
        self.slices: dict[str, slice] = {}
        start = 0
        for name in self.names:
            self.slices[name] = slice(start, start + sizes[name])
            start += sizes[name]
        self.count, self.width = len(self.low), start

    @staticmethod
    def _found(rig: Rig, sizes: Mapping[str, int], pattern: str, argument: str) -> list[str]:
        found = matching(pattern, list(sizes))
        if not found:
            raise ValueError(f"{argument}: no signal of the scenario matches `{pattern}`")
        for name in found:
            if name not in sizes:
                # The rig knows names that are similar.
                try:
                    rig.read(name)
                except KeyError as error:
                    raise ValueError(f"{argument}: {error.args[0]}") from None
        return found


class ActionLayout:
    """Process variables and outputs of the controller that an action sets."""

    def __init__(self, rig: Rig, actions: Names) -> None:
        ranges = {name: (low, high) for name, _, _, low, high in rig.variables()}
        sizes = {name: size for name, _, size in rig.signals()}
        self.variables: list[tuple[str, int]] = []
        self.outputs: list[tuple[str, slice]] = []
        self.places: list[str] = []
        lows, highs = [], []
        named = _named(actions, "actions")
        pairs = [(one, of) for name, of in named for one in matching(name, [*ranges, *sizes])]
        for name, given in pairs:
            place = f"actions[{name!r}]"
            if name in self.places:
                raise ValueError(f"{place}: named twice")
            start = len(self.places)
            if name in ranges:
                low, high = self._variable(given, ranges[name], place)
                self.variables.append((name, start))
            else:
                self._check_output(rig, name, ranges)
                if given is None:
                    raise ValueError(f"{place}: an output has no range: {_example(name)}")
                low, high = _limits(given, sizes[name], place)
                self.outputs.append((name, slice(start, start + sizes[name])))
            if not (np.isfinite(low).all() and np.isfinite(high).all()):
                raise ValueError(f"{place}: its range has no end: {_example(name)}")
            lows.append(low)
            highs.append(high)
            self.places += [name] * len(low)
        if not lows:
            raise ValueError("actions: expected at least one process variable or output")
        self.names = list(dict.fromkeys(self.places))
        self.low, self.high = np.concatenate(lows), np.concatenate(highs)
        self._rounding = ROUNDING * np.maximum(np.abs(self.low), np.abs(self.high))

    @staticmethod
    def _variable(
        given: Limits | None, permitted: tuple[float, float], place: str
    ) -> tuple[Floats, Floats]:
        low, high = _limits(given or permitted, 1, place)
        if low[0] < permitted[0] or high[0] > permitted[1]:
            raise ValueError(
                f"{place}: the variable is from {permitted[0]:g} to {permitted[1]:g}, which "
                f"{given!r} exceeds"
            )
        return low, high

    @staticmethod
    def _check_output(rig: Rig, name: str, variables: Mapping[str, Any]) -> None:
        try:
            rig.write(name, None)
        except KeyError as error:
            known = ", ".join(variables) or "none"
            raise ValueError(
                f"actions: `{name}` is neither a process variable ({known}) nor an output of the "
                f"controller: {error.args[0]}"
            ) from None

    def checked(self, actions: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
        """Return actions of the given shape as finite numbers within their limits.

        Numbers beyond a limit by no more than the rounding of 32 bits are set to it.
        """
        array = np.asarray(actions)
        if array.dtype.kind not in "fiu":
            raise TypeError(f"action: expected real numbers, not {array.dtype}")
        if array.shape != shape:
            raise ValueError(f"action: expected the shape {shape}, not {array.shape}")
        numbers = array.astype(np.float64)
        inside = numbers >= self.low - self._rounding
        inside &= numbers <= self.high + self._rounding
        if not inside.all():
            at = tuple(np.argwhere(~inside)[0])
            low, high = self.low[at[-1]], self.high[at[-1]]
            raise ValueError(
                f"action: {numbers[at]} for `{self.places[at[-1]]}` is not from {low:g} to {high:g}"
            )
        clipped: Floats = np.clip(numbers, self.low, self.high)
        return clipped

    def apply(self, rig: Rig, action: Floats) -> None:
        """Set variables and outputs from the next control step on."""
        for name, at in self.variables:
            rig.set_variable(name, float(action[at]))
        for name, span in self.outputs:
            rig.write(name, action[span])


def _example(name: str) -> str:
    return f"give limits, as in actions={{{name!r}: (0.0, 1.0)}}"
