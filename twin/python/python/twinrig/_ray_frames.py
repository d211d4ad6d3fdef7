"""Frames between a program and its Ray driver, a process of its own.

To the driver: a length of 8 bytes and the contents, of the header (JSON), the shared data and each
task. From the driver: a kind, the number of a task, a length of 4 bytes each and the contents.
Numbers are little-endian.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO

RESULT, PANIC, LOST, STATUS, ERROR, DONE = b"R", b"P", b"L", b"S", b"E", b"D"
"""Kinds: result of a task, its panic, its loss, status (JSON), error (JSON), end."""

Frame = tuple[bytes, int, bytes]
"""Kind, number of the task, contents."""
Emit = Callable[[Sequence[Frame]], None]
"""Writes frames."""


@dataclass(frozen=True)
class JobFrames:
    """A job as the driver gets it."""

    address: str | None
    """Address of the cluster."""
    jobs: int | None
    """Greatest number of tasks at the same time."""
    shared: bytes
    tasks: list[bytes]


def read_job(stream: BinaryIO) -> JobFrames:
    """Read a job."""

    def frame() -> bytes:
        (length,) = struct.unpack("<Q", _exactly(stream, 8))
        return _exactly(stream, length)

    header: dict[str, Any] = json.loads(frame())
    shared = frame()
    tasks = [frame() for _ in range(header["tasks"])]
    return JobFrames(header["address"], header["jobs"], shared, tasks)


def _exactly(stream: BinaryIO, count: int) -> bytes:
    read = stream.read(count)
    if len(read) != count:
        raise EOFError
    return read


def writer(stream: BinaryIO) -> Emit:
    """Return a function that writes frames at once."""

    def emit(frames: Sequence[Frame]) -> None:
        for kind, task, contents in frames:
            stream.write(kind + struct.pack("<II", task, len(contents)) + contents)
        stream.flush()

    return emit
