"""Costs of the engines of sweeps: `python twin/python/benches/engines.py`.

The same sweep by the engines `local` and `ray` (a Ray of its own on this machine), in turns, with
as many slots: of 20 s of the trot, and of runs of 20 ms, where little but the overhead is left.
Two sizes separate the start of an engine from a further row. Processor times are those of this
process and all that it starts; unlike rates, they hardly depend on the load of the machine. The
last lines are Ray alone, with tasks that do nothing: a batch, and a row in a batch of many.
"""

from __future__ import annotations

import os
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import twinrig
from twinrig import _ray
from twinrig._ray_frames import RESULT, Frame, JobFrames

ROOT = Path(__file__).resolve().parents[3]
ENGINES = ("local", "ray")
JOBS = 2
REPETITIONS = 3

STAND = """
robot = "cheetah-cub"
duration = "20 ms"
plant = { model = "massless" }
controller = { kind = "stand", period = "2 ms" }
"""


class ProcessorTime:
    """Processor time of this process and all that it starts [s], sampled as processes end."""

    PERIOD_S = 0.05

    def __init__(self) -> None:
        self.used_s: dict[int, float] = {}
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch)

    def __enter__(self) -> ProcessorTime:
        self._before = time.process_time()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self.own_s = time.process_time() - self._before

    def total_s(self) -> float:
        """Return the time of all processes."""
        return self.own_s + sum(self.used_s.values())

    def _watch(self) -> None:
        while not self._ended.wait(self.PERIOD_S):
            self._sample()

    def _sample(self) -> None:
        parents, used = {}, {}
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                fields = (folder / "stat").read_text().rpartition(") ")[2].split()
            except OSError:
                continue
            pid = int(folder.name)
            parents[pid] = int(fields[1])
            used[pid] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        known = {os.getpid()}
        while new := {pid for pid, parent in parents.items() if parent in known} - known:
            known |= new
        self.used_s.update((pid, used[pid]) for pid in known - {os.getpid()})


@dataclass(frozen=True)
class Cost:
    """Cost of a sweep [s]."""

    wall_s: float
    total_s: float
    """Processor time."""
    own_s: float
    """Of it, of the program."""


def sweep_cost(scenario: Path, runs: int, engine: str) -> Cost:
    """Return the cost of a sweep over seeds."""
    spec = {"dimension": [{"key": "seed", "from": 1, "to": runs}]}
    with tempfile.TemporaryDirectory() as out, ProcessorTime() as processors:
        begin = time.perf_counter()
        twinrig.sweep(scenario, spec, engine=engine, jobs=JOBS, out=out)
        wall_s = time.perf_counter() - begin
    return Cost(wall_s, processors.total_s(), processors.own_s)


def compare(name: str, scenario: Path, few: int, many: int) -> None:
    """Print the costs of both engines."""
    costs: dict[tuple[str, int], list[Cost]] = {}
    for _ in range(REPETITIONS):
        for runs in (few, many):
            for engine in ENGINES:
                cost = sweep_cost(scenario, runs, engine)
                costs.setdefault((engine, runs), []).append(cost)

    def median(engine: str, runs: int, of: Callable[[Cost], float]) -> float:
        return statistics.median(map(of, costs[engine, runs]))

    row_us = {}
    for engine in ENGINES:

        def a_row(of: Callable[[Cost], float], engine: str = engine) -> float:
            return (median(engine, many, of) - median(engine, few, of)) / (many - few)

        wall_s = median(engine, many, lambda cost: cost.wall_s)
        start_s = wall_s - many * a_row(lambda cost: cost.wall_s)
        row_us[engine] = a_row(lambda cost: cost.total_s) * 1e6
        own_us = a_row(lambda cost: cost.own_s) * 1e6
        print(
            f"{name}  {engine:5}  {many} runs in {wall_s:6.2f} s, {many / wall_s:7.1f} rows/s,"
            f" start {start_s:5.2f} s; processor a row {row_us[engine]:8.0f} µs,"
            f" program {own_us:8.0f} µs"
        )
    overhead_us = row_us["ray"] - row_us["local"]
    print(f"{name}  overhead of ray: {overhead_us:6.0f} µs of a processor a row")


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
