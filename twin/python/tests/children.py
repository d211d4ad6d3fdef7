"""Programs that a test interrupts."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]

# Python leaves SIGINT ignored where its parent does, as a shell does for jobs in the background.
HEARING = "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"


def interrupted(program: str, *arguments: str, after: float = 0.5) -> tuple[str, int]:
    """Run a program that prints ``ready``, interrupt it as Ctrl-C does, and return what it prints
    afterwards and its exit code.

    `after` is the time between both [s].
    """
    words = [sys.executable, "-c", HEARING + program, *arguments]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            time.sleep(after)
            process.send_signal(signal.SIGINT)
            out, _ = process.communicate(timeout=60)
        finally:
            process.kill()
    return out, process.returncode
