"""Rates of the engines of sweeps: `python twin/python/benches/engines.py`, on an idle machine.

The same sweep by the engines `local` and `ray` (a Ray of its own on this machine), in turns, with
as many slots: of 20 s of the trot, and of runs of 20 ms, where little but the overhead is left.
Two sizes separate the start of an engine from the time of a further row. The last lines are Ray
alone, with tasks that do nothing: the cost of a batch, and of a row in a batch of many.
"""

from __future__ import annotations

import os
import resource
import statistics
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import twinrig
from twinrig import _ray
from twinrig._ray_frames import RESULT, Frame, JobFrames

ROOT = Path(__file__).resolve().parents[3]
JOBS = 2
REPETITIONS = 3

STAND = """
robot = "cheetah-cub"
duration = "20 ms"
plant = { model = "massless" }
controller = { kind = "stand", period = "2 ms" }
"""


def sweep_s(scenario: Path, runs: int, engine: str) -> float:
    """Return the duration of a sweep over seeds [s]."""
    spec = {"dimension": [{"key": "seed", "from": 1, "to": runs}]}
    with tempfile.TemporaryDirectory() as out:
        begin = time.perf_counter()
        twinrig.sweep(scenario, spec, engine=engine, jobs=JOBS, out=out)
        return time.perf_counter() - begin


def compare(name: str, scenario: Path, few: int, many: int) -> None:
    """Print the rates of both engines."""
    durations: dict[tuple[str, int], list[float]] = {}
    for _ in range(REPETITIONS):
        for runs in (few, many):
            for engine in ("local", "ray"):
                taken = sweep_s(scenario, runs, engine)
                durations.setdefault((engine, runs), []).append(taken)
    row_s = {}
    for engine in ("local", "ray"):
        short = statistics.median(durations[engine, few])
        long = statistics.median(durations[engine, many])
        row_s[engine] = (long - short) / (many - few)
        print(
            f"{name}  {engine:5}  {many} runs in {long:6.2f} s, {many / long:8.1f} rows/s;"
            f" start {short - few * row_s[engine]:5.2f} s, then {1 / row_s[engine]:8.1f} rows/s"
        )
    before = resource.getrusage(resource.RUSAGE_SELF)
    sweep_s(scenario, many, "ray")
    after = resource.getrusage(resource.RUSAGE_SELF)
    head_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    overhead_us = (row_s["ray"] - row_s["local"]) * 1e6 * JOBS
    print(
        f"{name}  ray - local: {overhead_us:8.0f} µs of a processor a row,"
        f" of which the program {head_s / many * 1e6:6.0f} µs"
    )


def ray_alone() -> None:
    """Print the cost of batches and rows that do nothing."""

    # By value, as workers do not have this program.
    def slow(_digest: str, _data: Any, tasks: list[bytes]) -> Any:
        # A pretended second makes batches of one task.
        return float(len(tasks)), [(True, task) for task in tasks]

    def fast(_digest: str, _data: Any, tasks: list[bytes]) -> Any:
        return 1e-6 * len(tasks), [(True, task) for task in tasks]

    for name, do, count in (("batch of 1", slow, 2000), ("row of a batch", fast, 200_000)):
        arrivals: list[float] = []

        def emit(frames: Sequence[Frame], arrivals: list[float] = arrivals) -> None:
            now = time.perf_counter()
            arrivals.extend(now for kind, _, _ in frames if kind == RESULT)

        job = JobFrames(None, JOBS, b"", [bytes(60)] * count)
        _ray.Driver(job, emit, do).run()
        # The first tenth includes the start of the workers.
        first = count // 10
        taken = (arrivals[-1] - arrivals[first]) / (count - 1 - first)
        print(f"ray alone  {name}: {taken * 1e6:8.1f} µs")


def main() -> None:
    """Print all rates."""
    load = os.getloadavg()[0]
    print(f"{JOBS} slots, {os.cpu_count()} processors, load {load:.1f}, medians of {REPETITIONS}")
    with tempfile.TemporaryDirectory() as folder:
        stand = Path(folder) / "stand.toml"
        stand.write_text(STAND, encoding="utf-8")
        compare("trot 20 s  ", ROOT / "scenarios/trot.toml", 40, 400)
        compare("stand 20 ms", stand, 2000, 20_000)
    ray_alone()


if __name__ == "__main__":
    main()
