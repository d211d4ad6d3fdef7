"""Tasks of a job on a worker of a Ray cluster.

The driver sends this module by value, as a worker has no package `twinrig` before `do` loads it.
Ray has a way of its own for wheels, `py_modules`: it runs the `pip` that it finds, which may belong
to another interpreter, knows wheels by their names only, and several nodes on one machine disturb
each other.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Sequence
from typing import Any

_jobs: dict[str, Any] = {}
"""The job that this process works at, by its digest."""

_folders: dict[str, Any] = {}
"""Folder of the package, and the stream whose end removes it."""

Ended = tuple[float, list["tuple[bool, bytes] | None"]]
"""Duration of a batch [s]; for each task whether it ended without a panic, and its result."""


def do(digest: str, data: Sequence[Any], tasks: list[bytes]) -> Ended:
    """Do the tasks of a batch.

    `data` are references to the wheel of the package and to the shared data of the job. In a list
    they are fetched here, where they are new to the process.
    """
    job = _jobs.get(digest)
    if job is None:
        import ray

        _jobs.clear()
        job = _jobs[digest] = _load(*ray.get(list(data)))
    begun = time.monotonic()
    results = job.run(tasks)
    return time.monotonic() - begun, results


def _load(wheel: bytes, shared: bytes) -> Any:
    """Load the package of a wheel, and the job.

    The package stays as long as this process, as processes of FMUs load it, too.
    """
    if not _folders:
        folder, stream = _folder_of_this_process()
        zipfile.ZipFile(io.BytesIO(wheel)).extractall(folder)
        sys.path.insert(0, folder)
        _folders[folder] = stream
    from twinrig._native import WorkerJob

    return WorkerJob(shared)


def _folder_of_this_process() -> tuple[str, Any]:
    """Return a new folder that is removed at the end of this process, also if it is killed.

    It is the worker's own: another user of the machine cannot write to it. A shell removes it when
    its standard input is closed. It is no child of this process, as Ray kills those.
    """
    folder = tempfile.mkdtemp(prefix="twinrig-")
    remove = 'exec 3<&0; (read -r _ <&3; exec rm -rf "$0") >/dev/null 2>&1 &'
    shell = subprocess.Popen(
        ["/bin/sh", "-c", remove, folder], stdin=subprocess.PIPE, start_new_session=True
    )
    shell.wait()
    return folder, shell.stdin
