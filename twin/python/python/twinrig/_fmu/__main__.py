"""Serves a worker over pipes: `python -m twinrig._fmu FOLDER`, started by the native half.

A request is its kind (one byte), the size of its content (four bytes, little-endian) and the
content; a reply has the status in place of the kind. Requests come from standard input and replies
go to standard output, or rather to copies of both: an FMU that reads or prints finds an empty
input, and standard error.
"""

from __future__ import annotations

import os
import select
import shutil
import signal
import struct
import sys
import threading
import time
from typing import BinaryIO, NoReturn

_HEAD = struct.Struct("<BI")

_WATCH_PERIOD_S = 0.5


def _own_descriptors() -> tuple[int, int]:
    """Keep the pipes from output and input of the FMU."""
    requests, replies = os.dup(0), os.dup(1)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    return requests, replies


def _watch(requests: int, parent: int, folder: str) -> NoReturn:
    """End this process with its parent, also in the midst of a call that never returns."""
    poll = select.poll()
    poll.register(requests, 0)
    # A fork of the parent may hold the pipe open beyond its death.
    while not poll.poll(1e3 * _WATCH_PERIOD_S) and os.getppid() == parent:
        pass
    # The pipe is closed by a parent that waits for the end of this process, or by the death of the
    # parent, which becomes visible a moment later.
    while os.getppid() == parent:
        time.sleep(_WATCH_PERIOD_S)
    shutil.rmtree(folder, ignore_errors=True)
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError


def _exactly(stream: BinaryIO, size: int) -> bytes | None:
    content = stream.read(size)
    return content if len(content) == size else None


def _serve(folder: str, requests: BinaryIO, replies: BinaryIO) -> None:
    # FMPy takes most of the time to start, which the parent need not wait for.
    from twinrig._fmu._worker import Worker

    worker = Worker(folder, echo=True)
    while (head := _exactly(requests, _HEAD.size)) is not None:
        request, size = _HEAD.unpack(head)
        content = _exactly(requests, size)
        if content is None:
            break
        status, reply = worker.call(request, content)
        replies.write(_HEAD.pack(status, len(reply)))
        replies.write(reply)
        replies.flush()
    worker.close()


def main() -> None:
    """Serve until the parent closes the pipe."""
    folder, parent = sys.argv[1], os.getppid()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    requests, replies = _own_descriptors()
    watch = threading.Thread(target=_watch, args=(requests, parent, folder), daemon=True)
    watch.start()
    with open(requests, "rb") as source, open(replies, "wb") as sink:
        _serve(folder, source, sink)
    # The parent does the same, if it lives.
    shutil.rmtree(folder, ignore_errors=True)
    # Threads and destructors of the FMU have no say any more.
    sys.stderr.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
