"""A Ray cluster on this machine, which a test damages: a program of its own.

Its standard input has commands, a line each: ``add node``, and ``kill node`` and ``kill head``,
which end a machine at once.
All processes of the cluster end with this one, however it ends, and it ends with the test.
"""

from __future__ import annotations

import os
import secrets
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

TOKEN = secrets.token_hex(32)
"""Token of the clusters of one test program."""

ENVIRONMENT = {
    "RAY_AUTH_MODE": "token",
    "RAY_AUTH_TOKEN": TOKEN,
    "RAY_USAGE_STATS_ENABLED": "0",
}

STORE_BYTES = 80_000_000


class Cluster:
    """A running cluster of a head without processors and of machines with one each."""

    def __init__(self, process: subprocess.Popen[str], address: str) -> None:
        self._process, self.address = process, address

    def kill(self, machine: str) -> None:
        """Kill all processes of the ``node`` that was started last, or of the ``head``."""
        self._do(f"kill {machine}")

    def add_node(self) -> None:
        """Start a machine."""
        self._do("add node")

    def _do(self, command: str) -> None:
        assert self._process.stdin is not None and self._process.stdout is not None
        print(command, file=self._process.stdin, flush=True)
        assert self._process.stdout.readline() == "done\n"


@contextmanager
def cluster(nodes: int) -> Iterator[Cluster]:
    """Run a cluster on this machine."""
    with tempfile.TemporaryDirectory(prefix="ray-") as folder:
        words = [sys.executable, __file__, str(nodes), folder]
        # The machines have the package of a wheel only.
        environment = {**os.environ, **ENVIRONMENT}
        environment.pop("PYTHONPATH", None)
        log = Path(folder) / "cluster.log"
        with (
            log.open("w", encoding="utf-8") as errors,
            subprocess.Popen(
                words,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                env=environment,
                cwd=folder,
            ) as process,
        ):
            try:
                assert process.stdout is not None
                address = process.stdout.readline().strip()
                assert address, log.read_text(encoding="utf-8")
                yield Cluster(process, address)
            finally:
                process.kill()


def main(nodes: int, folder: str) -> None:
    """Start a cluster and obey the standard input."""
    frames = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    from ray.cluster_utils import Cluster as Machines

    common: dict[str, Any] = {"object_store_memory": STORE_BYTES, "include_dashboard": False}
    # Ray writes the address of a cluster there, and makes the folder of others only.
    Path("/tmp/ray").mkdir(exist_ok=True)
    machines = Machines()
    head = machines.add_node(num_cpus=0, temp_dir=folder, **common)
    others = [machines.add_node(num_cpus=1, **common) for _ in range(nodes)]
    print(machines.address, file=frames, flush=True)
    for line in sys.stdin:
        if line == "add node\n":
            others.append(machines.add_node(num_cpus=1, **common))
        else:
            machine = head if line == "kill head\n" else others.pop()
            machine.kill_all_processes(check_alive=False, allow_graceful=False)
        print("done", file=frames, flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])
