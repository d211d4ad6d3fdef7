"""Rates of environments: `python twin/python/benches/gym.py`, on an idle machine.

Median durations of steps of one environment, of a vector and of a rollout, beside those of their
rigs, and of resets by restoring and by building the rig.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import twinrig
from twinrig.gym import TwinEnv, TwinVectorEnv

TROT = Path(__file__).resolve().parents[3] / "scenarios/trot.toml"
COUNT = 16

ARGUMENTS: dict[str, Any] = {
    "observations": ["body/velocity", "body/rpy", "leg/*/hip/position"],
    "actions": {"frequency": (2.5, 4.0), "step_length": (0.08, 0.14)},
    "reward": lambda step: float(step["body/velocity"][0]),
    "set": {"duration": "1000000 s"},
}
ACTION = [3.6, 0.13]


def median_us(call: Callable[[], object], count: int) -> float:
    """Return the median duration of a call [µs]."""
    durations = []
    for _ in range(count):
        begin = time.perf_counter()
        call()
        durations.append(time.perf_counter() - begin)
    return statistics.median(durations) * 1e6


def steps(step: float) -> None:
    """Print the durations of a step of `step` [s]."""
    count = max(20, round(1.0 / step))
    env = TwinEnv(TROT, **ARGUMENTS, step=step)
    env.reset()
    of_env = median_us(lambda: env.step(ACTION), count)
    rig = env.rig
    of_rig = median_us(lambda: rig.step(until=rig.now + step), count)
    print(f"{step * 1e3:5.0f} ms  one: {of_env:8.1f} µs, {of_rig:8.1f} µs in its rig", end="")
    actions = np.tile(ACTION, (COUNT, 1))
    for threads in sorted({1, os.cpu_count() or 1}):
        print(f"; of {COUNT}, {threads} threads: ", end="")
        for batched in (False, True):
            arguments = {**ARGUMENTS, "reward": speeds} if batched else ARGUMENTS
            vector = TwinVectorEnv(
                COUNT, TROT, **arguments, step=step, threads=threads, batched=batched
            )
            vector.reset()
            of_one = median_us(lambda: vector.step(actions), count) / COUNT
            print(f"{of_one:7.1f} µs each{' (batched)' if batched else ','}", end="")
            vector.close()
        rollout = twinrig.Rollout(
            TROT,
            ARGUMENTS["observations"],
            step=step,
            set=ARGUMENTS["set"],
            fingerprint=False,
            threads=threads,
        )
        # Short calls, so that other programs disturb few of them.
        length = max(1, round(0.2 / step))
        given = {
            name: np.full((COUNT, length), value)
            for name, value in zip(ARGUMENTS["actions"], ACTION)
        }
        of_one = median_us(lambda: rollout.run(None, given), 100) / COUNT / length
        print(f", {of_one:7.1f} µs in a rollout", end="")
    print()


def speeds(step: Any) -> Any:
    """Return the rewards of all environments."""
    return step["body/velocity"][:, 0]


def resets() -> None:
    """Print the durations of a reset."""
    env = TwinEnv(TROT, **ARGUMENTS)
    seeds = iter(range(10_000))
    restored = median_us(env.reset, 200)
    built = median_us(lambda: env.reset(seed=next(seeds)), 200)
    print(f"reset  restored: {restored:.1f} µs; built: {built:.1f} µs")


if __name__ == "__main__":
    print(f"twinrig {twinrig.__version__}, load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores")
    for duration in (0.002, 0.02, 0.1):
        steps(duration)
    resets()
