"""A campaign on a cluster, simulated as a queue: `python twin/python/benches/cluster_queue.py`.

Batches of runs, as the engine `ray` forms them, are done by the slots of many machines. Runs last
as measured; some are stragglers; machines fail at random, lose their batches, which are repeated
as single runs, and return after a time. The table has time, cost and storage. Everything random is
drawn from one seed, and no clock is read: equal arguments give equal tables.
"""

from __future__ import annotations

import argparse
import heapq
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from twinrig._ray_batches import MACHINES, BatchQueue


@dataclass(frozen=True)
class Campaign:
    """A campaign and the cluster that does it."""

    runs: int = 1_000_000
    machines: int = 100
    slots: int = 16
    """Slots of a machine."""
    run_s: float = 0.05
    """Mean duration of a run on one slot [s]."""
    spread: float = 0.3
    """Standard deviation of the logarithm of the duration of a run."""
    straggler_share: float = 0.0
    straggler_factor: float = 10.0
    """Duration of a straggler, as a multiple."""
    batch_s: float = 0.002
    """Overhead of a batch on its slot [s]."""
    mtbf_s: float = float("inf")
    """Mean time between failures of one machine [s]."""
    restart_s: float = 300.0
    """Time until a failed machine has another in its place [s]."""
    head_row_s: float = 0.0
    """Time of the head, which handles one row at a time [s]."""
    seed: int = 1


@dataclass
class Outcome:
    """Course of a campaign."""

    wall_s: float = 0.0
    """Time until the last row [s]."""
    head_s: float = 0.0
    """Time for which the head was busy [s]."""
    batches: int = 0
    failures: int = 0
    repeated: int = 0
    """Runs that were begun again."""
    given_up: int = 0


@dataclass
class _Slot:
    machine: int
    batch: list[int] = field(default_factory=list)
    begun_s: float = 0.0
    ends_s: float = 0.0


class _Simulation:
    """Events in the order of their times: the end of a batch, the failure of a machine."""

    def __init__(self, campaign: Campaign) -> None:
        self.campaign = campaign
        self.numbers = np.random.default_rng(campaign.seed)
        self.queue = BatchQueue(campaign.runs)
        self.slots = [_Slot(n) for n in range(campaign.machines) for _ in range(campaign.slots)]
        self.idle: list[int] = []
        self.version = [0] * len(self.slots)
        """Number of the batch that each slot works at; the end of any other is void."""
        self.events: list[tuple[float, int, str, int, int]] = []
        self.count = 0
        self.left = campaign.runs
        self.outcome = Outcome()
        sigma = campaign.spread
        drawn = self.numbers.lognormal(-0.5 * sigma**2, sigma, campaign.runs)
        is_slow = self.numbers.random(campaign.runs) < campaign.straggler_share
        factor = np.where(is_slow, campaign.straggler_factor, 1.0)
        self.durations_s = campaign.run_s * drawn * factor

    def at(self, time_s: float, kind: str, index: int, version: int = 0) -> None:
        """Schedule an event."""
        self.count += 1
        heapq.heappush(self.events, (time_s, self.count, kind, index, version))

    def begin(self, index: int, now_s: float) -> None:
        """Give a slot its next batch, if there is one."""
        slot = self.slots[index]
        slot.batch = self.queue.take(len(self.slots))
        if not slot.batch:
            self.idle.append(index)
            return
        self.outcome.batches += 1
        work_s = float(self.durations_s[slot.batch].sum())
        slot.begun_s, slot.ends_s = now_s, now_s + self.campaign.batch_s + work_s
        self.at(slot.ends_s, "end", index, self.outcome.batches)
        self.version[index] = self.outcome.batches

    def fail(self, machine: int, now_s: float) -> None:
        """Lose the batches of a machine."""
        self.outcome.failures += 1
        for index, slot in enumerate(self.slots):
            if slot.machine == machine:
                self.version[index] = 0
                if slot.batch:
                    given_up = self.queue.lost(slot.batch, MACHINES)
                    self.left -= len(given_up)
                    self.outcome.given_up += len(given_up)
                    slot.batch = []
        self.idle = [index for index in self.idle if self.slots[index].machine != machine]
        self.at(now_s + self.campaign.restart_s, "start", machine)

    def run(self) -> Outcome:
        """Simulate until the last row."""
        campaign, outcome = self.campaign, self.outcome
        head_free_s = 0.0
        for index in range(len(self.slots)):
            self.begin(index, 0.0)
        for machine in range(campaign.machines):
            self.at(self.life_s(), "fail", machine)
        while self.left:
            now_s, _, kind, index, version = heapq.heappop(self.events)
            if kind == "end" and self.version[index] == version:
                slot = self.slots[index]
                self.left -= len(slot.batch)
                self.queue.done(slot.batch, slot.ends_s - slot.begun_s)
                handling_s = campaign.head_row_s * len(slot.batch)
                head_free_s = max(head_free_s, now_s) + handling_s
                outcome.head_s += handling_s
                outcome.wall_s = head_free_s
                slot.batch = []
                self.begin(index, now_s)
            elif kind == "fail":
                self.fail(index, now_s)
            elif kind == "start":
                self.at(now_s + self.life_s(), "fail", index)
                self.idle += [n for n, slot in enumerate(self.slots) if slot.machine == index]
            if self.idle and self.queue.left():
                idle, self.idle = self.idle, []
                for slot_index in idle:
                    self.begin(slot_index, now_s)
        outcome.repeated = self.queue.repeated
        return outcome

    def life_s(self) -> float:
        """Draw the time until a machine fails [s]."""
        mtbf_s = self.campaign.mtbf_s
        return float(self.numbers.exponential(mtbf_s)) if np.isfinite(mtbf_s) else float("inf")


def simulated(campaign: Campaign) -> Outcome:
    """Return the course of a campaign."""
    return _Simulation(campaign).run()


@dataclass(frozen=True)
class Prices:
    """ASSUMED prices, for orders of magnitude: enter those of your provider."""

    slot_hour: float = 0.04
    """Of one slot for an hour."""
    gigabyte_month: float = 0.02
    """Of storage."""


@dataclass(frozen=True)
class Sizes:
    """Measured sizes of a run [bytes]."""

    row: int = 2_500
    """Line of the store."""
    recording: int = 4_000_000


def table(campaign: Campaign, prices: Prices, sizes: Sizes) -> str:
    """Return the table of several courses, in Markdown."""
    ideal_s = campaign.runs * campaign.run_s / (campaign.machines * campaign.slots)
    slow = {"straggler_share": 0.01, "straggler_factor": 20.0}
    failing = {"mtbf_s": 24 * 3600.0}
    cases: list[tuple[str, dict[str, float]]] = [
        ("no stragglers, no failures", {}),
        ("1 % of the runs take 20 times as long", slow),
        ("each machine fails once a day", failing),
        ("each machine fails once an hour", {"mtbf_s": 3600.0}),
        ("stragglers, and failures once an hour", {**slow, "mtbf_s": 3600.0}),
    ]
    lines = [
        "| case | time | × ideal | failures | begun again | head busy | cost |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, changes in cases:
        outcome = simulated(replace(campaign, **changes))  # type: ignore[arg-type]
        slots = campaign.machines * campaign.slots
        cost = outcome.wall_s / 3600 * slots * prices.slot_hour
        lines.append(
            f"| {name} | {outcome.wall_s:.0f} s | {outcome.wall_s / ideal_s:.2f} |"
            f" {outcome.failures} | {outcome.repeated} |"
            f" {100 * outcome.head_s / outcome.wall_s:.0f} % | {cost:.2f} |"
        )
    rows_gb, recordings_gb = (campaign.runs * size / 1e9 for size in (sizes.row, sizes.recording))
    month = prices.gigabyte_month
    lines += [
        "",
        f"Ideal: {ideal_s:.0f} s. Rows: {rows_gb:.1f} GB at the head. Recordings of all runs:"
        f" {recordings_gb:.0f} GB, {recordings_gb / campaign.machines:.0f} GB a machine,"
        f" {recordings_gb * month:.0f} a month.",
    ]
    return "\n".join(lines)


def main() -> None:
    """Print the table of the arguments."""
    parser = argparse.ArgumentParser(description=__doc__)
    for defaults in (Campaign(), Prices(), Sizes()):
        for name, value in vars(defaults).items():
            parser.add_argument(f"--{name.replace('_', '-')}", type=type(value), default=value)
    given = vars(parser.parse_args())

    def of(kind: type) -> dict[str, Any]:
        return {field.name: given[field.name] for field in fields(kind)}

    print(table(Campaign(**of(Campaign)), Prices(**of(Prices)), Sizes(**of(Sizes))))


if __name__ == "__main__":
    main()
