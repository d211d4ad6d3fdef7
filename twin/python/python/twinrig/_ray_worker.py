"""Tasks of a job on a worker of a Ray cluster."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from twinrig._native import WorkerJob

_jobs: dict[str, WorkerJob] = {}
"""The job that this process works at, by the hash of its shared data."""

Ended = tuple[float, list["tuple[bool, bytes] | None"]]
"""Duration of a batch [s]; for each task whether it ended without a panic, and its result."""


def do(digest: str, shared: Sequence[Any], tasks: list[bytes]) -> Ended:
    """Do the tasks of a batch; `shared` is a list with a reference to the shared data.

    A reference in a list is fetched here, where the data is new to the process.
    """
    import ray

    job = _jobs.get(digest)
    if job is None:
        _jobs.clear()
        job = _jobs[digest] = WorkerJob(ray.get(shared[0]))
    begun = time.monotonic()
    results = job.run(tasks)
    return time.monotonic() - begun, results
