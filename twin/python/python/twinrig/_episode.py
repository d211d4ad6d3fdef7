"""A rig as the simulation behind an environment."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from twinrig._layouts import ActionLayout, Names, SignalLayout
from twinrig._native import Lane
from twinrig._parts import Channels, Floats, PartSource
from twinrig._rig import Rig
from twinrig._scenario import Scenario


class Values(Mapping[str, Floats]):
    """Values of signals at one time, by name: read-only arrays of the shape ``(size,)``."""

    __slots__ = ("_flat", "_slices")

    def __init__(self, flat: Floats, slices: Mapping[str, Any]) -> None:
        self._flat = flat
        self._slices = slices

    def __getitem__(self, name: str) -> Floats:
        try:
            found: Floats = self._flat[self._slices[name]]
        except KeyError:
            raise KeyError(f"signal `{name}` is not read: add it to `signals`") from None
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self._slices)

    def __len__(self) -> int:
        return len(self._slices)


class Step:
    """A step of an environment, for its reward and its termination.

    ``step["body/position"]`` are the values of a signal at the end of the step.
    """

    __slots__ = ("action", "after", "before", "duration", "has_fallen", "time")

    time: float
    """Time of its end [s]."""
    duration: float
    """Its duration [s]."""
    action: Floats
    """Action, shape ``(k,)``, in the units of its variables and signals."""
    has_fallen: bool
    """Whether the robot is on the ground at its end, by the thresholds `fall` of the scenario."""
    before: Values
    """Signals at its begin: those of `observations` and `signals`."""
    after: Values
    """The same signals at its end."""

    def __getitem__(self, name: str) -> Floats:
        return self.after[name]


class BatchStep:
    """A step of all environments of a vector, for their rewards and terminations.

    ``step["body/position"]`` are the values of a signal at the end of the step, shape
    ``(num_envs, size)``. What is returned for environments that begin an episode in this step, with
    the same signals before and after, is ignored.
    """

    __slots__ = ("action", "after", "before", "duration", "has_fallen", "time")

    time: Floats
    """Time of its end [s], shape ``(num_envs,)``."""
    duration: float
    """Its duration [s]."""
    action: Floats
    """Actions, shape ``(num_envs, k)``."""
    has_fallen: npt.NDArray[np.bool_]
    """Whether robots are on the ground at its end, shape ``(num_envs,)``."""
    before: Values
    """Signals at its begin, each of the shape ``(num_envs, size)``."""
    after: Values
    """The same signals at its end."""

    def __getitem__(self, name: str) -> Floats:
        return self.after[name]


Reward: TypeAlias = Callable[[Step], float]
Termination: TypeAlias = Callable[[Step], bool]
BatchReward: TypeAlias = Callable[[BatchStep], npt.ArrayLike]
BatchTermination: TypeAlias = Callable[[BatchStep], npt.ArrayLike]


class Episode:
    """Simulation of one environment, which is reset to its start again and again."""

    def __init__(
        self,
        scenario: Scenario,
        *,
        set: Mapping[str, Any] | None,
        plant: str | None,
        controllers: Mapping[str, PartSource] | None,
        plants: Mapping[str, PartSource] | None,
        fingerprint: bool = True,
    ) -> None:
        self._set = dict(set or {})
        self._rig = partial(
            Rig,
            scenario,
            plant=plant,
            controllers=controllers,
            plants=plants,
            fingerprint=fingerprint,
        )
        self._key: tuple[int | None, str] | None = None
        self._start = b""
        self._lane: Lane | None = None
        self.rig: Rig
        self.newest: Floats
        self.is_over = True
        self.prepare(None, {})

    def prepare(self, seed: int | None, settings: Mapping[str, Any]) -> None:
        """Bring the rig to time 0: by its saved state if seed and settings are the former ones."""
        key = (seed, repr(settings))
        if key == self._key:
            self.rig.restore(self._start)
        else:
            rig = self._rig(set={**self._set, **settings}, seed=seed)
            if self._key is not None:
                self.rig.close()
            self.rig, self._key, self._start = rig, key, rig.save()
            self._lane = None

    def lane(self, names: Channels) -> Lane:
        """Return the rig with these commands and signals, always the same ones."""
        if self._lane is None:
            self._lane = Lane(self.rig, names)
        return self._lane

    def begin(self, layout: SignalLayout) -> None:
        """Read the signals of time 0."""
        self.is_over = False
        self.newest = self._read(layout)

    def fail(self) -> None:
        """Note that the rig has failed: it is built anew for the next episode."""
        self._key, self.is_over = None, True
        self.rig.close()

    def _read(self, layout: SignalLayout) -> Floats:
        flat = self.rig.read(layout.names)
        flat.flags.writeable = False
        return flat

    def end_step(self, layout: SignalLayout, action: Floats, duration: float) -> Step:
        """Return the step that the rig has made."""
        step = Step()
        step.time, step.duration, step.action = self.rig.now, duration, action
        step.has_fallen = self.rig.has_fallen
        after = self._read(layout)
        step.before, step.after = Values(self.newest, layout.slices), Values(after, layout.slices)
        self.newest = after
        return step

    def observation(self, layout: SignalLayout) -> Floats:
        """Return the newest observation, shape ``(count,)``."""
        return self.newest[: layout.count].copy()


NANOSECONDS = 1_000_000_000

Result: TypeAlias = tuple[Floats, float, bool, bool, dict[str, Any]]
"""Observation, reward, terminated, truncated, info."""


class Task:
    """Purpose and time limits of episodes, common to the environments of a vector."""

    def __init__(
        self,
        rig: Rig,
        observations: Names,
        actions: Names,
        reward: Reward | BatchReward,
        *,
        signals: Sequence[str],
        step: float | None,
        duration: float | None,
        terminated: Termination | BatchTermination | None,
    ) -> None:
        for name, function in (("reward", reward), ("terminated", terminated)):
            if function is not None and not callable(function):
                raise TypeError(f"{name}: expected a function, not {type(function).__name__}")
        self.signals = SignalLayout(rig, observations, signals)
        self.actions = ActionLayout(rig, actions)
        self.reward: Callable[[Any], Any] = reward
        self.terminated: Callable[[Any], Any] | None = terminated
        self.step = rig.period if step is None else _seconds(step, "step")
        end = rig.duration if duration is None else _seconds(duration, "duration")
        if end > rig.duration:
            raise ValueError(
                f"duration: {duration} s is longer than the scenario, {rig.duration} s: "
                'give it a longer one by `set={"duration": …}`'
            )
        self._end_ns = _nanoseconds(end)
        if self.step < rig.period:
            raise ValueError(f"step: {step} s is shorter than the control period, {rig.period} s")

    def reward_of(self, step: Step) -> float:
        """Return the reward of a step."""
        reward = float(self.reward(step))
        if not math.isfinite(reward):
            raise ValueError(f"reward: {reward} at {step.time:.6g} s is not a finite number")
        return reward

    def truncated(self, times: Any) -> Any:
        """Return whether episodes have reached their end at these times [s]."""
        return np.rint(times * NANOSECONDS) >= self._end_ns

    def info(self, episode: Episode, has_fallen: bool) -> dict[str, Any]:
        """Return `info` of the newest step."""
        newest = Values(episode.newest, self.signals.slices)
        signals = {name: newest[name].copy() for name in self.signals.shown}
        return {"time": episode.rig.now, "has_fallen": has_fallen, **signals}

    def begin(self, episode: Episode) -> tuple[Floats, dict[str, Any]]:
        """Return the first observation and `info` of an episode."""
        episode.begin(self.signals)
        return episode.observation(self.signals), self.info(episode, episode.rig.has_fallen)

    def finish(self, episode: Episode, action: Floats) -> Result:
        """Judge the step that the rig has made."""
        step = episode.end_step(self.signals, action, self.step)
        reward = self.reward_of(step)
        terminated = bool(self.terminated(step)) if self.terminated else step.has_fallen
        truncated = bool(self.truncated(step.time))
        episode.is_over = terminated or truncated
        info = self.info(episode, step.has_fallen)
        return episode.observation(self.signals), reward, terminated, truncated, info


def _nanoseconds(seconds: float) -> int:
    return round(seconds * NANOSECONDS)


def _seconds(value: float, argument: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError(f"{argument}: expected a time in seconds, not {type(value).__name__}")
    if not 1 / NANOSECONDS <= value < math.inf:
        raise ValueError(f"{argument}: expected a time above 0 s, not {value} s")
    return float(value)
