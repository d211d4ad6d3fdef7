"""Failures of an FMU."""

from __future__ import annotations


class Refusal(Exception):
    """The FMU cannot be used, for a reason that is known before its first step."""


class Fault(Exception):
    """A call of the FMU failed."""

    def __init__(self, part: str, why: str) -> None:
        super().__init__(why)
        self.part = part
        """Function or variable that failed."""
        self.why = why


class Termination(Fault):
    """The FMU ended the simulation."""
