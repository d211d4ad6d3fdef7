"""Costs of a step of 2 ms by FMPy and by libcosim, against the rig itself.

``python twin/fmu/benches/steps.py [SCENARIO]`` measures all of them in one process, repeatedly and
in turns, and prints the medians. It needs the packages of the tests, and the wheel with its library.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import twinrig

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from masters import ROOT, TROT, Cosim, Fmu, export

REPETITIONS = 5
STEP = 0.002
STEPS = 5000
POSITION = "body/position"


def timed(work: Callable[[], None]) -> float:
    """Return the wall time of a step [µs]."""
    started = time.perf_counter()
    work()
    return (time.perf_counter() - started) / STEPS * 1e6


def native(scenario: Path, *, in_one_call: bool) -> float:
    """Measure the rig of the Python package."""
    with twinrig.Rig(scenario) as rig:
        if in_one_call:
            return timed(lambda: rig.step(until=STEPS * STEP) and None)

        def steps() -> None:
            for n in range(1, STEPS + 1):
                rig.step(until=n * STEP)
                rig.read(POSITION)

        return timed(steps)


def by_fmpy(fmu: Fmu) -> float:
    """Measure steps by FMPy, in which all inputs are set and one output is read."""
    inputs = [one.name for one in fmu.variables.values() if one.causality == "input"]
    references = [fmu.references[name] for name in inputs]
    with fmu.instance() as instance:
        values = instance.read(inputs)
        raw = instance.raw
        set_inputs = raw.setFloat64 if fmu.is_fmi3 else raw.setReal
        names = [POSITION] if fmu.is_fmi3 else [f"{POSITION}[{n}]" for n in range(3)]

        def steps() -> None:
            for n in range(1, STEPS + 1):
                set_inputs(references, values)
                instance.step_to(n * STEP)
                instance.read(names)

        return timed(steps)


def by_libcosim(fmu: Fmu) -> float:
    """Measure steps by libcosim, with an observer that reads all outputs."""
    cosim = Cosim(fmu, STEP)
    cosim.step()
    return timed(lambda: cosim.step(STEPS))


def main() -> None:
    scenario = ROOT / (sys.argv[1] if len(sys.argv) > 1 else TROT)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        fmus = {
            f"{part}, FMI {fmi}.0": Fmu(
                export(path / f"{part}{fmi}.fmu", str(scenario), part, fmi)
            )
            for part in ("rig", "plant")
            for fmi in (2, 3)
        }
        work: dict[str, Callable[[], float]] = {
            "rig, in one call": lambda: native(scenario, in_one_call=True),
            "rig, step by step from Python": lambda: native(scenario, in_one_call=False),
        }
        for name, fmu in fmus.items():
            work[f"{name}, by FMPy"] = lambda fmu=fmu: by_fmpy(fmu)  # type: ignore[misc]
            if not fmu.is_fmi3:
                work[f"{name}, by libcosim"] = lambda fmu=fmu: by_libcosim(fmu)  # type: ignore[misc]
        results: dict[str, list[float]] = {name: [] for name in work}
        for _ in range(REPETITIONS):
            for name, measure in work.items():
                results[name].append(measure())
        for name, times in results.items():
            print(f"{statistics.median(times):8.2f} µs a step  {name}")
        for fmu in fmus.values():
            fmu.close()


main()
