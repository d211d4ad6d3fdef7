"""Log messages of FMUs: the newest, of bounded length."""

from __future__ import annotations

import os
from collections import deque

_MESSAGES = 8
_LENGTH = 300

_OK = 0
_LABELS = ("ok", "warning", "discard", "error", "fatal", "pending")


class Log:
    """The newest messages of an FMU."""

    def __init__(self, *, echo: bool) -> None:
        self._messages: deque[str] = deque(maxlen=_MESSAGES)
        # After a crash, messages on standard error are all that is left of the process.
        self._echo = echo

    def add(self, status: int, message: bytes | None) -> None:
        """Keep a message, unless it reports a success."""
        # Some FMUs report every step; the reason of a fault would be lost among such messages.
        if status == _OK:
            return
        label = _LABELS[status] if 0 <= status < len(_LABELS) else str(status)
        text = (message or b"").decode("utf-8", errors="replace").strip()
        line = " ".join(f"{label}: {text}".split())[:_LENGTH]
        self._messages.append(line)
        if self._echo:
            os.write(2, f"{line}\n".encode())

    def take(self) -> str:
        """Text of the messages since the last call, for the end of a sentence.

        Messages that are echoed are in the output of the process already.
        """
        if self._echo:
            return ""
        lines = [line for line in self._messages if not line.endswith(": ")]
        self._messages.clear()
        return f"; log of the FMU: {' | '.join(lines)}" if lines else ""
