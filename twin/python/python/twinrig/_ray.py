"""Ray driver: a process that does the tasks of a job on the workers of a Ray cluster.

It is apart from the program, because Ray ends its driver's process when it loses the cluster. The
program reads results from the standard output and closes the standard input to end the work.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from twinrig import _ray_worker
from twinrig._ray_address import LOCAL, ClusterError, reachable, requested
from twinrig._ray_batches import ATTEMPTS, MACHINES, BatchQueue
from twinrig._ray_frames import (
    DONE,
    ERROR,
    LOST,
    PANIC,
    RESULT,
    STATUS,
    Emit,
    JobFrames,
    read_job,
    writer,
)
from twinrig._ray_wheel import wheel

POLL_S = 0.1
"""Greatest time between two checks for a request to end [s]."""
STATUS_S = 1.0
"""Time between two states of the cluster [s]."""
EMPTY_S = 300.0
"""Time for which a cluster may have no slot [s]."""
EXIT_S = 2.0
"""Time to leave a cluster [s]."""

STORE_BYTES = 100_000_000
"""Object store of a Ray of our own: the shared data of a job, and no results."""

REPEAT = "the same command continues, on another cluster or by the engine local"


class Driver:
    """Work at one job."""

    def __init__(
        self,
        job: JobFrames,
        emit: Emit,
        do: Callable[..., _ray_worker.Ended] = _ray_worker.do,
    ) -> None:
        """Prepare the work; `do` is called on the workers."""
        self.job, self.emit, self.do = job, emit, do
        self.stopped = threading.Event()
        self.queue = BatchQueue(len(job.tasks))
        self.slots = 0
        self._flying: dict[Any, list[int]] = {}
        self._status_due = self._slots_seen = 0.0

    def run(self) -> None:
        """Do all tasks, unless the work is stopped."""
        address = requested(self.job.address)
        try:
            ray: Any = import_module("ray")
        except ImportError:
            raise ClusterError(
                "the package ray is not installed", 'install it: pip install "twinrig[ray]"'
            ) from None
        with _connected(ray, self.job, reachable(address)):
            self._slots_seen = time.monotonic()
            ray.cloudpickle.register_pickle_by_value(_ray_worker)
            remote = ray.remote(num_cpus=1, max_retries=0)(self.do)
            data = [ray.put(wheel()), ray.put(self.job.shared)]
            digest = hashlib.sha256(self.job.shared).hexdigest()
            while not self.stopped.is_set() and (self.queue.left() or self._flying):
                self._report(ray)
                while len(self._flying) < self._most() and (batch := self.queue.take(self.slots)):
                    tasks = [self.job.tasks[task] for task in batch]
                    self._flying[remote.remote(digest, data, tasks)] = batch
                self._collect(ray)

    def _most(self) -> int:
        """Return the number of batches on their way: a second one waits at each slot."""
        most = 2 * self.slots
        return most if self.job.jobs is None else min(most, self.job.jobs)

    def _report(self, ray: Any) -> None:
        """Look at the cluster from time to time, as machines join and leave it."""
        now = time.monotonic()
        if now < self._status_due:
            return
        self._status_due = now + STATUS_S
        nodes = [node["Resources"].get("CPU", 0) for node in ray.nodes() if node["Alive"]]
        self.slots = sum(map(int, nodes))
        if self.slots:
            self._slots_seen = now
        waits_s = max(0.0, self._slots_seen + EMPTY_S - now)
        if not waits_s:
            raise ClusterError(
                f"the cluster has had no slot for {EMPTY_S:.0f} s",
                f"start a machine with slots, `ray start --address=HOST:PORT`; {REPEAT}",
            )
        workers = self.slots if self.job.jobs is None else min(self.slots, self.job.jobs)
        status = {
            "workers": workers,
            "machines": sum(1 for slots in nodes if slots),
            "repeated": self.queue.repeated,
            "waits_s": None if self.slots else round(waits_s),
        }
        self.emit([(STATUS, 0, json.dumps(status).encode())])

    def _collect(self, ray: Any) -> None:
        """Wait for a batch for a short time, and pass on the results of all that have ended."""
        if not self._flying:
            self.stopped.wait(POLL_S)
            return
        ended, _ = ray.wait(list(self._flying), num_returns=1, timeout=POLL_S)
        if ended:
            count = len(self._flying)
            ended, _ = ray.wait(list(self._flying), num_returns=count, timeout=0)
        for reference in ended:
            batch = self._flying.pop(reference)
            try:
                seconds, results = ray.get(reference)
            except Exception as error:
                self._lose(ray.exceptions, batch, error)
            else:
                self._keep(batch, seconds, results)

    def _keep(
        self, batch: list[int], seconds: float, results: list[tuple[bool, bytes] | None]
    ) -> None:
        """Pass on the results of a batch; those of tasks that were interrupted are missing."""
        self.queue.done(batch, seconds)
        frames = []
        for task, result in zip(batch, results, strict=True):
            if result is None:
                self.queue.lost([task])
            else:
                frames.append((RESULT if result[0] else PANIC, task, result[1]))
        self.emit(frames)

    def _lose(self, exceptions: Any, batch: list[int], error: Exception) -> None:
        """Queue the tasks of a batch again whose worker is lost; any other error is the job's."""
        reason = _first_line(error)
        if isinstance(error, exceptions.RayTaskError):
            cause = getattr(error, "cause", None) or error
            if isinstance(cause, ImportError):
                raise ClusterError(
                    f"a worker cannot load the package: {cause}",
                    "all machines need the same platform, Python 3.10 or newer, and NumPy",
                ) from None
            message, _, help = _message(cause).partition("\n  = help: ")
            raise ClusterError(message, f"{help}; {REPEAT}" if help else REPEAT) from None
        if isinstance(error, exceptions.LocalRayletDiedError):
            raise ClusterError(f"the cluster is lost: {reason}", REPEAT) from None
        limit = MACHINES if isinstance(error, exceptions.NodeDiedError) else ATTEMPTS
        for task in self.queue.lost(batch, limit):
            lost = f"{limit} workers were lost in it, the last one by: {reason}"
            self.emit([(LOST, task, lost.encode())])


def _first_line(error: BaseException) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[0] if lines else type(error).__name__


def _message(error: BaseException) -> str:
    return str(error).strip() or type(error).__name__


@contextmanager
def _connected(ray: Any, job: JobFrames, address: str) -> Iterator[None]:
    """Connect to the cluster, or start a Ray of our own on this machine."""
    options: dict[str, Any] = {}
    if address == LOCAL:
        options = {
            "num_cpus": job.jobs,
            "object_store_memory": STORE_BYTES,
            "include_dashboard": False,
            "_node_ip_address": "127.0.0.1",
        }
    try:
        ray.init(address=address, log_to_driver=False, logging_level="error", **options)
    except ray.exceptions.AuthenticationError as error:
        raise ClusterError(
            f"the token of the cluster is missing: {_first_line(error).split('. ')[0]}",
            "set RAY_AUTH_TOKEN_PATH or RAY_AUTH_TOKEN as on the head",
        ) from error
    except Exception as error:
        raise ClusterError(
            f"`{address}` answers, but cannot be joined: {_message(error)}",
            "check that a head of the same version of Ray has this port, with the same"
            " RAY_AUTH_MODE and token as here",
        ) from error
    try:
        yield
    finally:
        ray.shutdown()


def _stop_with_the_program(driver: Driver) -> None:
    """End the work when the standard input is closed, as it is when the program ends."""
    while os.read(0, 4096):
        pass
    driver.stopped.set()
    time.sleep(EXIT_S)
    os._exit(1)


def main() -> None:
    """Do the job of the standard input."""
    # What Ray and others print does not belong among the frames.
    emit = writer(os.fdopen(os.dup(1), "wb"))
    os.dup2(2, 1)
    with os.fdopen(os.dup(0), "rb", buffering=1 << 16) as stream:
        job = read_job(stream)
    driver = Driver(job, emit)
    threading.Thread(target=_stop_with_the_program, args=[driver], daemon=True).start()
    try:
        driver.run()
    except ClusterError as error:
        failure = {"message": str(error), "help": error.help}
        emit([(ERROR, 0, json.dumps(failure).encode())])
        sys.exit(1)
    emit([(DONE, 0, b"")])


if __name__ == "__main__":
    main()
