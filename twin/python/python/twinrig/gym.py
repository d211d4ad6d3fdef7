"""Environments of Gymnasium: scenarios whose controller is set by actions.

>>> from twinrig.gym import TwinEnv
>>> env = TwinEnv(
...     "scenarios/trot.toml",
...     observations=["body/velocity", "body/rpy"],
...     actions={"frequency": (2.5, 4.0), "step_length": (0.08, 0.14)},
...     reward=lambda step: step["body/velocity"][0],
...     step=0.1,
... )
>>> observation, info = env.reset(seed=1)
>>> observation, reward, terminated, truncated, info = env.step([3.2, 0.12])

`TwinVectorEnv` has many of them, on all cores.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from twinrig._episode import (
    BatchReward,
    BatchStep,
    BatchTermination,
    Episode,
    Reward,
    Step,
    Task,
    Termination,
    Values,
)
from twinrig._layouts import Names
from twinrig._native import step_lanes
from twinrig._parts import Floats, PartSource
from twinrig._rig import Rig, Workers
from twinrig._scenario import Scenario

try:
    import gymnasium
    from gymnasium.spaces import Box, Space
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ImportError as _error:
    raise ImportError(
        "twinrig.gym requires the package gymnasium: pip install 'twinrig[gym]'"
    ) from _error

__all__ = ["BatchStep", "Step", "TwinEnv", "TwinVectorEnv"]

ID = "Twinrig-v0"
"""Name of `TwinEnv` for `gymnasium.make`."""

DRAWN_SEEDS = 2**32
"""Number of the seeds that `reseed` draws from."""


class Seeds:
    """Seeds of the scenario, episode by episode."""

    def __init__(self, reseed: bool) -> None:
        self._reseed = reseed
        self.current: int | None = None

    def next(self, given: int | None, draw: Callable[[], np.random.Generator]) -> int | None:
        """Return the seed of the next episode; ``None``: that of the scenario."""
        if given is not None:
            self.current = given
        elif self._reseed:
            self.current = int(draw().integers(DRAWN_SEEDS))
        return self.current


Draw: TypeAlias = Callable[[np.random.Generator], Mapping[str, Any]]
"""Settings of an episode, drawn from the random numbers of its environment."""


class Settings:
    """Settings of the episodes of environments, in the argument `options` of `reset`.

    Its key ``set`` is a dictionary, a sequence of dictionaries, one an environment, or a function
    that draws a dictionary at the beginning of each episode.
    """

    def __init__(self, options: Mapping[str, Any] | None, count: int) -> None:
        unknown = [name for name in options or {} if name != "set"]
        if unknown:
            raise ValueError(f"options: unknown key {unknown[0]!r}; known is 'set'")
        given = (options or {}).get("set") or {}
        self._draw: Draw | None = given if callable(given) else None
        many = isinstance(given, Sequence) and not isinstance(given, str)
        self._each = list(given) if many else [{} if self._draw else given] * count
        if len(self._each) != count:
            raise ValueError(f"options['set']: expected {count} dictionaries, not {len(given)}")
        for settings in self._each:
            _check_mapping(settings)

    def of(self, index: int, generator: Callable[[], np.random.Generator]) -> Mapping[str, Any]:
        """Return the settings of the next episode of an environment."""
        if self._draw is None:
            settings: Mapping[str, Any] = self._each[index]
            return settings
        drawn = self._draw(generator())
        _check_mapping(drawn)
        return drawn


def _check_mapping(settings: object) -> None:
    if not isinstance(settings, Mapping):
        raise TypeError(f"options['set']: expected a dictionary, not {type(settings).__name__}")


class TwinEnv(gymnasium.Env[Floats, Floats]):
    """A scenario as an environment.

    Its controller runs as in the scenario; an action sets process variables of it, or replaces its
    outputs, from the next control step on, which is one control period later. The episode begins at
    time 0. It is truncated at the end of the scenario, and terminated by a fall. Expectations are
    not judged.

    Parameters
    ----------
    scenario, set, plant, controllers, plants
        As of `twinrig.Rig`.
    observations
        Signals, as a list of names, or a dictionary from name to ``(low, high)``, the limits of the
        space; by default it has none. ``*`` is a part of a name and ``**`` several:
        ``leg/*/hip/position``. An observation has their values one after the other: shape
        ``(m,)``, in the units of the signals.
    actions
        Process variables (``frequency``) and outputs of the controller (``leg/LF/hip/command``), as
        a list of names, or a dictionary from name to ``(low, high)``. Limits may be left out, or be
        ``None``, for a process variable with a finite range. An action has the shape ``(k,)``.
    reward
        Function of a `Step` that returns a number.
    signals
        Further signals for `reward` and `terminated`, which are in `info`, too.
    step
        Duration of an action [s], a control period by default.
    duration
        Duration of an episode [s], that of the scenario by default and at most.
    terminated
        Function of a `Step` that returns whether the episode is terminated. By default it is by a
        fall, with the thresholds `fall` of the scenario, seen at the ends of steps.
    reseed
        Whether an episode that is begun without a seed draws one. By default it has that of the
        last one, which is faster: the rig is restored instead of being built.

    Notes
    -----
    The seed of ``reset(seed=…)`` is the seed of the scenario, which is that of all its random
    streams; without one, the scenario's own. With `reseed`, later seeds are drawn from
    `np_random`. ``reset(options={"set": {"plant.ground.friction": 0.4}})`` changes settings for one
    episode, for which a rig is built.
    """

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(
        self,
        scenario: Scenario,
        observations: Names,
        actions: Names,
        reward: Reward,
        *,
        set: Mapping[str, Any] | None = None,
        plant: str | None = None,
        controllers: Mapping[str, PartSource] | None = None,
        plants: Mapping[str, PartSource] | None = None,
        signals: Sequence[str] = (),
        step: float | None = None,
        duration: float | None = None,
        terminated: Termination | None = None,
        reseed: bool = False,
        render_mode: None = None,
    ) -> None:
        self._episode = Episode(
            scenario, set=set, plant=plant, controllers=controllers, plants=plants
        )
        self._task = Task(
            self._episode.rig,
            observations,
            actions,
            reward,
            signals=signals,
            step=step,
            duration=duration,
            terminated=terminated,
        )
        self._seeds = Seeds(reseed)
        self.render_mode = render_mode
        self.observation_space, self.action_space = _spaces(self._task)

    @property
    def rig(self) -> Rig:
        """The rig of this episode."""
        return self._episode.rig

    @property
    def scenario_seed(self) -> int | None:
        """Seed of this episode; ``None``: that of the scenario."""
        return self._seeds.current

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Begin an episode, with the settings ``options["set"]``: a dictionary, or a function that
        draws it from a generator of NumPy.

        Returns the observation, shape ``(m,)``, and `info`: `time` [s], `has_fallen`, and the
        values of `signals` by their names.
        """
        super().reset(seed=seed)
        settings = Settings(options, 1)
        scenario_seed = self._seeds.next(seed, lambda: self.np_random)
        self._episode.prepare(scenario_seed, settings.of(0, lambda: self.np_random))
        return self._task.begin(self._episode)

    def step(self, action: npt.ArrayLike) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Apply an action, shape ``(k,)``, for the duration of a step.

        Returns observation, reward, whether the episode is terminated, whether it is truncated, and
        `info`, as `reset`.

        Raises
        ------
        ValueError
            The action has another shape, or a value is NaN or out of its limits.
        RunError
            A part of the rig has failed; the next episode can begin.
        """
        episode, task = self._episode, self._task
        if episode.is_over:
            raise gymnasium.error.ResetNeeded("the episode has not begun, or is over: call `reset`")
        checked = task.actions.checked(action, task.actions.low.shape)
        try:
            task.actions.apply(episode.rig, checked)
            episode.rig.step(until=min(episode.rig.now + task.step, episode.rig.duration))
        except Exception:
            episode.fail()
            raise
        return task.finish(episode, checked)

    def close(self) -> None:
        """Close the rig."""
        self._episode.rig.close()


class TwinVectorEnv(VectorEnv[Floats, Floats, npt.NDArray[Any]]):
    """`num_envs` environments of one scenario, whose rigs advance on all cores.

    Every one has the results of a `TwinEnv`, bit for bit and for every number of threads. An
    episode that is over is followed by the next one in the next step, whose action is ignored and
    whose reward is 0 (`AutoresetMode.NEXT_STEP`).

    Parameters
    ----------
    num_envs
        Number of environments.
    threads
        Number of threads, one a core by default.

    batched
        Whether `reward` and `terminated` are functions of a `BatchStep`, which are called once for
        all environments and return arrays of the shape ``(num_envs,)``; by default, they are called
        for one environment after the other.

    The others are those of `TwinEnv`. The caller's thread calls `reward` and `terminated`.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int,
        scenario: Scenario,
        observations: Names,
        actions: Names,
        reward: Reward | BatchReward,
        *,
        set: Mapping[str, Any] | None = None,
        plant: str | None = None,
        controllers: Mapping[str, PartSource] | None = None,
        plants: Mapping[str, PartSource] | None = None,
        signals: Sequence[str] = (),
        step: float | None = None,
        duration: float | None = None,
        terminated: Termination | BatchTermination | None = None,
        reseed: bool = False,
        threads: int | None = None,
        batched: bool = False,
        render_mode: None = None,
    ) -> None:
        if num_envs < 1:
            raise ValueError(f"num_envs: expected at least 1, not {num_envs}")
        self.num_envs, self.render_mode = num_envs, render_mode
        self._episodes = [
            Episode(
                scenario,
                set=set,
                plant=plant,
                controllers=controllers,
                plants=plants,
                fingerprint=False,
            )
            for _ in range(num_envs)
        ]
        self._task = Task(
            self._episodes[0].rig,
            observations,
            actions,
            reward,
            signals=signals,
            step=step,
            duration=duration,
            terminated=terminated,
        )
        self._batched = batched
        self._names = self._task.actions.names, self._task.signals.names
        self._newest = _Newest(num_envs, self._task.signals.width)
        self._is_over = np.ones(num_envs, np.bool_)
        self._seeds = [Seeds(reseed) for _ in range(num_envs)]
        self._draws: list[np.random.Generator | None] = [None] * num_envs
        self._workers = Workers(threads)
        self._settings = Settings(None, num_envs)
        self._has_begun = False
        self.single_observation_space, self.single_action_space = _spaces(self._task)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Floats, dict[str, Any]]:
        """Begin an episode in every environment; the seeds of an integer n are n, n + 1 and so on.

        The settings ``options["set"]`` apply to this episode and to those that follow it without a
        call of `reset`: a dictionary, a sequence of dictionaries, one an environment, or a
        function that draws one from a generator of NumPy for each episode of each environment.

        Returns the observations, shape ``(num_envs, m)``, and `info` with arrays whose first index
        is the environment.
        """
        settings = Settings(options, self.num_envs)
        first = [None] * self.num_envs if seed is None else seed
        seeds = [first + i for i in range(self.num_envs)] if isinstance(first, int) else first
        if len(seeds) != self.num_envs:
            raise ValueError(f"seed: expected {self.num_envs} seeds, not {len(seeds)}")
        self._settings = settings
        newest = _Newest(self.num_envs, self._task.signals.width)
        for i in range(self.num_envs):
            self._begin(i, seeds[i], newest)
        self._newest, self._has_begun = newest, True
        return self._observations(), self._info()

    def _begin(self, index: int, seed: int | None, newest: _Newest) -> None:
        """Begin an episode of one environment."""
        if seed is not None:
            self._draws[index] = gymnasium.utils.seeding.np_random(seed)[0]
        seed = self._seeds[index].next(seed, lambda: self._generator(index))
        settings = self._settings.of(index, lambda: self._generator(index))
        episode = self._episodes[index]
        episode.prepare(seed, settings)
        rig = episode.rig
        newest.values[index] = rig.read(self._task.signals.names)
        newest.times[index], newest.has_fallen[index] = rig.now, rig.has_fallen
        self._is_over[index] = False

    def _generator(self, index: int) -> np.random.Generator:
        """Return the generator of later seeds of one environment."""
        generator = self._draws[index] or gymnasium.utils.seeding.np_random()[0]
        self._draws[index] = generator
        return generator

    def step(
        self, actions: npt.ArrayLike
    ) -> tuple[Floats, Floats, npt.NDArray[np.bool_], npt.NDArray[np.bool_], dict[str, Any]]:
        """Apply actions, shape ``(num_envs, k)``, for the duration of a step.

        Returns observations, shape ``(num_envs, m)``; rewards, terminated and truncated, shape
        ``(num_envs,)``; and `info`, as `reset`. An exception, as of `TwinEnv.step`, names the
        environment; all of them then begin anew with `reset`.
        """
        if not self._has_begun:
            raise gymnasium.error.ResetNeeded("the episodes have not begun: call `reset`")
        layout = self._task.actions
        checked = layout.checked(actions, (self.num_envs, *layout.low.shape))
        self._has_begun = False  # Unless all succeeds.
        begins = self._is_over.copy()
        newest = self._advance(np.flatnonzero(~begins), checked)
        judge = self._judge_batch if self._batched else self._judge_each
        rewards, terminated = judge(newest, checked, begins)
        truncated = self._task.truncated(newest.times) & ~begins
        self._newest, self._is_over = newest, terminated | truncated
        self._has_begun = True
        return self._observations(), rewards, terminated, truncated, self._info()

    def _advance(self, running: npt.NDArray[np.intp], actions: Floats) -> _Newest:
        """Advance the rigs of environments by a step, and return what is newest then."""
        lanes = [self._episodes[i].lane(self._names) for i in running]
        of_running = actions if len(lanes) == self.num_envs else actions[running]
        values, times, has_fallen, errors = step_lanes(
            lanes, of_running.ravel(), self._task.step, self._workers
        )
        first = None
        for i, failed in zip(running, errors, strict=True):
            if failed is None:
                continue
            error = failed[2]
            self._episodes[i].fail()
            if hasattr(error, "add_note"):
                error.add_note(f"in environment {i}")
            first = first or error
        if first is not None:
            raise first
        newest = _Newest(self.num_envs, self._task.signals.width)
        newest.values[running] = values.reshape(len(lanes), self._task.signals.width)
        newest.times[running], newest.has_fallen[running] = times, has_fallen
        return newest

    def _judge_each(
        self, newest: _Newest, actions: Floats, begins: npt.NDArray[np.bool_]
    ) -> tuple[Floats, npt.NDArray[np.bool_]]:
        """Return rewards and terminations of environments, each of its own step."""
        task, slices = self._task, self._task.signals.slices
        rewards = np.zeros(self.num_envs)
        terminated = newest.has_fallen & ~begins
        rows = zip(
            self._newest.shown,
            newest.shown,
            newest.times.tolist(),
            newest.has_fallen.tolist(),
            begins.tolist(),
            strict=True,
        )
        for i, (before, after, time, has_fallen, is_begin) in enumerate(rows):
            if is_begin:
                self._begin(i, None, newest)
                continue
            step = Step()
            step.time, step.duration, step.has_fallen = time, task.step, has_fallen
            step.action = actions[i]
            step.before, step.after = Values(before, slices), Values(after, slices)
            rewards[i] = task.reward_of(step)
            if task.terminated is not None:
                terminated[i] = bool(task.terminated(step))
        return rewards, terminated

    def _judge_batch(
        self, newest: _Newest, actions: Floats, begins: npt.NDArray[np.bool_]
    ) -> tuple[Floats, npt.NDArray[np.bool_]]:
        """Return rewards and terminations of environments, of one step of all of them."""
        task = self._task
        before = self._newest.shown
        if begins.any():
            for i in np.flatnonzero(begins):
                self._begin(int(i), None, newest)
            # Those that begin have the same signals before and after.
            before = np.where(begins[:, None], newest.values, before)
            before.flags.writeable = False
        slices = {name: (slice(None), span) for name, span in task.signals.slices.items()}
        step = BatchStep()
        step.time, step.duration, step.has_fallen = newest.times, task.step, newest.has_fallen
        step.action = actions
        step.before, step.after = Values(before, slices), Values(newest.shown, slices)
        rewards = np.where(begins, 0.0, self._array(task.reward(step), np.float64, "reward"))
        if not np.isfinite(rewards).all():
            at = int(np.argmin(np.isfinite(rewards)))
            raise ValueError(f"reward: {rewards[at]} of environment {at} is not a finite number")
        terminated = newest.has_fallen
        if task.terminated is not None:
            terminated = self._array(task.terminated(step), np.bool_, "terminated")
        return rewards, terminated & ~begins

    def _array(self, values: object, kind: type, argument: str) -> npt.NDArray[Any]:
        array: npt.NDArray[Any] = np.asarray(values, kind)
        if array.shape != (self.num_envs,):
            raise ValueError(
                f"{argument}: expected the shape ({self.num_envs},), not {array.shape}"
            )
        return array

    def _observations(self) -> Floats:
        return self._newest.values[:, : self._task.signals.count].copy()

    def _info(self) -> dict[str, Any]:
        """Return `info`: an array for each key, and which environments have it: all."""
        newest, layout = self._newest, self._task.signals
        named = {"time": newest.times.copy(), "has_fallen": newest.has_fallen.copy()}
        named |= {name: newest.values[:, layout.slices[name]].copy() for name in layout.shown}
        info: dict[str, Any] = {}
        for name, array in named.items():
            info[name], info[f"_{name}"] = array, np.ones(self.num_envs, np.bool_)
        return info

    def close_extras(self, **_: Any) -> None:
        """Close the rigs."""
        for episode in self._episodes:
            episode.rig.close()


def _spaces(task: Task) -> tuple[Space[Floats], Space[Floats]]:
    """Return the spaces of observations and actions, of 64-bit floats."""
    observations, actions = task.signals, task.actions
    return (
        Box(observations.low, observations.high, dtype=np.float64),
        Box(actions.low, actions.high, dtype=np.float64),
    )


class _Newest:
    """Newest signals, times and falls of environments."""

    def __init__(self, count: int, width: int) -> None:
        self.values = np.empty((count, width))
        self.times = np.empty(count)
        self.has_fallen = np.empty(count, np.bool_)
        self.shown = self.values.view()
        """`values` for functions that must not change them."""
        self.shown.flags.writeable = False


gymnasium.register(
    ID, entry_point="twinrig.gym:TwinEnv", vector_entry_point="twinrig.gym:TwinVectorEnv"
)
