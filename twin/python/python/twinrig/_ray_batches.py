"""Division of tasks into batches, which keep workers busy and losses small."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

TARGET_S = 1.0
"""Intended duration of a batch [s]: long against the overhead, short against a loss."""

SIZE_MAX = 1000
"""Greatest number of tasks of a batch."""

ATTEMPTS = 3
"""Processes that one task may outlive, before it is given up."""

MACHINES = 10
"""Machines that it may outlive: they mostly fail for reasons of their own."""


@dataclass
class BatchQueue:
    """Tasks that are not done yet, by number.

    The duration of tasks is measured as they end. The first batches have one task each. A batch
    whose worker is lost is divided into single tasks, of which one may be the reason: only tasks
    that lose a worker each time are given up, and no other one with them.
    """

    count: int
    """Tasks are the numbers below it."""
    repeated: int = 0
    """Tasks that were begun again."""
    _next: int = 0
    _suspects: deque[int] = field(default_factory=deque)
    _attempts: dict[tuple[int, int], int] = field(default_factory=dict)
    _seconds: float = 0.0
    _measured: int = 0

    def left(self) -> int:
        """Return the number of tasks that are in no batch."""
        return self.count - self._next + len(self._suspects)

    def take(self, slots: int) -> list[int]:
        """Return the next batch for one of several slots; empty if there is none."""
        if self._suspects:
            return [self._suspects.popleft()]
        size = min(self._size(), -(-(self.count - self._next) // (2 * max(slots, 1))))
        first, self._next = self._next, min(self._next + size, self.count)
        return list(range(first, self._next))

    def _size(self) -> int:
        if self._measured == 0:
            return 1
        ideal = TARGET_S * self._measured / max(self._seconds, 1e-9)
        return max(1, min(SIZE_MAX, int(ideal)))

    def done(self, batch: Sequence[int], seconds: float) -> None:
        """Take the duration of a batch into account [s]."""
        self._seconds += seconds
        self._measured += len(batch)

    def lost(self, batch: Sequence[int], limit: int = ATTEMPTS) -> list[int]:
        """Queue the tasks of a batch whose worker is lost; return those that are given up.

        A single task is given up when it is lost for the last of `limit` times, `ATTEMPTS` or
        `MACHINES`, which are counted separately.
        """
        if len(batch) == 1:
            attempt = (batch[0], limit)
            self._attempts[attempt] = self._attempts.get(attempt, 0) + 1
            if self._attempts[attempt] >= limit:
                return list(batch)
        self._suspects.extend(batch)
        self.repeated += len(batch)
        return []
