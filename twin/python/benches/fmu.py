"""Costs of a plant that is an FMU, beside the native plant that it was exported from.

``twin export fmu scenarios/trot.toml --out trot.fmu``, then
``python twin/python/benches/fmu.py trot.fmu [SCENARIO]`` runs the scenario with its native plant,
with the FMU in a process of its own and in this one, and makes the same calls of the FMU from
Python by FMPy alone; all in one process, repeatedly and in turns. It prints the medians.
"""

from __future__ import annotations

import shutil
import statistics
import sys
import time
from pathlib import Path
from typing import Any

import fmpy
import twinrig
from fmpy.fmi2 import FMU2Slave

REPETITIONS = 9
DURATION = 20.0


def in_rig(scenario: str, fmu: str | None, *, isolated: bool = True) -> float:
    """Return the wall time [s] of a rig with the native plant, or with an FMU in its place."""
    plant: dict[str, Any] = {"plant.model": "fmu", "plant.isolated": isolated, "plant.file": fmu}
    with twinrig.Rig(scenario, set=plant if fmu else {}) as rig:
        started = time.perf_counter()
        rig.step(until=DURATION)
        return time.perf_counter() - started


def started_in(scenario: str, fmu: str) -> float:
    """Return the wall time [s] of building a rig with an FMU in a process of its own."""
    started = time.perf_counter()
    twinrig.Rig(scenario, set={"plant.model": "fmu", "plant.file": fmu}).close()
    return time.perf_counter() - started


def by_fmpy(fmu: str, step: float) -> float:
    """Return the wall time [s] of the same steps by FMPy, with all inputs and outputs."""
    description = fmpy.read_model_description(fmu)
    folder = fmpy.extract(fmu)
    try:
        slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
        )
        slave.instantiate()
        slave.setupExperiment()
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        of = {
            causality: [
                it.valueReference
                for it in description.modelVariables
                if it.causality == causality and it.type == "Real"
            ]
            for causality in ("input", "output")
        }
        values = slave.getReal(of["input"])
        started = time.perf_counter()
        for n in range(round(DURATION / step)):
            slave.setReal(of["input"], values)
            slave.doStep(n * step, step)
            slave.getReal(of["output"])
        took = time.perf_counter() - started
        slave.terminate()
        slave.freeInstance()
    finally:
        shutil.rmtree(folder)
    return took


def main() -> None:
    """Measure and print."""
    if len(sys.argv) not in (2, 3):
        sys.exit("usage: python twin/python/benches/fmu.py FMU [SCENARIO]")
    fmu = str(Path(sys.argv[1]).absolute())
    scenario = sys.argv[2] if len(sys.argv) > 2 else "scenarios/trot.toml"
    with twinrig.Rig(scenario) as rig:
        step = rig.period
    rows: list[list[float]] = []
    for _ in range(REPETITIONS):
        rows.append(
            [
                in_rig(scenario, None),
                in_rig(scenario, fmu),
                in_rig(scenario, fmu, isolated=False),
                by_fmpy(fmu, step),
                started_in(scenario, fmu),
            ]
        )
    native, own, here, alone, start = (statistics.median(column) for column in zip(*rows))
    steps = round(DURATION / step)
    print(f"{scenario}: {steps} steps of {1e3 * step:g} ms, medians of {REPETITIONS}")
    for name, took in (
        ("native plant", native),
        ("FMU in its own process", own),
        ("FMU in this process", here),
        ("the same calls by FMPy", alone),
    ):
        print(f"  {name:<24} {1e6 * took / steps:6.1f} µs a step")
    print(f"  start of its own process {1e3 * start:6.0f} ms")


if __name__ == "__main__":
    main()
