"""Costs of Python around the physics: of a call of `Rig.step`, and of a controller in Python.

``python twin/python/benches/steps.py [SCENARIO]`` measures both in one process, repeatedly and in
turns, and prints the medians. A scenario whose control period is 2 ms has a controller at 500 Hz.
"""

from __future__ import annotations

import math
import os
import statistics
import sys
import time
from typing import Any

import numpy as np
import twinrig
from twinrig import Input, Output

REPETITIONS = 9
DURATION = 20.0
LEGS = ("LF", "RF", "LH", "RH")
PHASES = np.array([0.0, 0.5, 0.5, 0.0])
KIND = {"controller": {"kind": "gait", "period": "2 ms"}, "expect": []}


class Gait:
    """A trot of sines, with attitude feedback."""

    ports = [
        *(Output(f"leg/{leg}/hip/command", "rad") for leg in LEGS),
        *(Output(f"leg/{leg}/knee/command", "rad") for leg in LEGS),
        Input("body/rpy", "rad", 3),
    ]

    def __init__(self) -> None:
        self.time = 0.0

    def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
        self.time += elapsed
        angle = 2.0 * math.pi * (3.0 * self.time + PHASES)
        outputs[:4] = 0.2 * np.sin(angle) - 0.1 * inputs[1]
        outputs[4:] = 0.05 * np.maximum(0.0, np.cos(angle))


class Silent(Gait):
    """Commands zeros: the cost of the call alone."""

    def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
        pass


def stepped(scenario: str) -> float:
    """Return the wall time [s] of steps of one control period each."""
    with twinrig.Rig(scenario) as rig:
        step, count = rig.step, round(DURATION / rig.period)
        started = time.perf_counter()
        for _ in range(count):
            step()
        return time.perf_counter() - started


def at_once(scenario: str, controller: type[Gait] | None = None) -> float:
    """Return the wall time [s] of the same events in one call."""
    parts: dict[str, Any] = {"set": KIND, "controllers": {"gait": controller}} if controller else {}
    with twinrig.Rig(scenario, **parts) as rig:
        started = time.perf_counter()
        rig.step(until=DURATION)
        return time.perf_counter() - started


def alone(controller: type[Gait]) -> float:
    """Return the wall time [s] of the iterations of a controller without a rig."""
    gait, inputs, outputs = controller(), np.zeros(3), np.zeros(8)
    started = time.perf_counter()
    for _ in range(round(DURATION / 0.002)):
        gait.step(0.002, inputs, outputs)
    return time.perf_counter() - started


def main() -> None:
    """Measure and print."""
    scenario = sys.argv[1] if len(sys.argv) > 1 else "scenarios/trot.toml"
    with twinrig.Rig(scenario) as rig:
        calls = round(DURATION / rig.period)
    rows: list[list[float]] = []
    for _ in range(REPETITIONS):
        row = [stepped(scenario), at_once(scenario), at_once(scenario, Gait)]
        rows.append([*row, at_once(scenario, Silent), alone(Gait)])
    many, one, gait, silent, body = (statistics.median(column) for column in zip(*rows))
    print(f"{scenario}, {DURATION:.0f} s, load {os.getloadavg()[0]:.1f}, {REPETITIONS} repetitions")
    print(f"a call of Rig.step       {(many - one) / calls * 1e6:6.2f} µs beyond the physics")
    print(f"compiled controller      {DURATION / one:6.0f} × real time")
    print(f"controller in Python     {DURATION / gait:6.0f} × real time")
    print(f"  of which its own code  {body / gait * 100:6.1f} %")
    print(f"empty step in Python     {DURATION / silent:6.0f} × real time")


if __name__ == "__main__":
    main()
