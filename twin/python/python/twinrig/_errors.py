"""Exceptions and warnings of the package."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from twinrig._run import Run


@dataclass(frozen=True)
class Problem:
    """A mistake in a scenario or robot file."""

    file: str
    """Path of the file, or the argument that set the value: ``set=``."""
    line: int | None
    """Line, counted from 1; ``None`` if the problem concerns the whole file."""
    column: int | None
    """Column in characters, counted from 1."""
    message: str
    help: str
    """Remedy; may be empty."""


class TwinError(Exception):
    """Base of the exceptions of this package; the text is that of the program `twin`."""


class ScenarioError(TwinError):
    """A scenario that cannot be run: mistakes in its file, or parts that cannot be built."""

    problems: list[Problem]
    """Mistakes in files, in their order; empty if a part cannot be built."""

    def __init__(self, message: str, problems: Sequence[Problem] = ()) -> None:
        super().__init__(message)
        self.problems = list(problems)

    def __reduce__(self) -> tuple[type[ScenarioError], tuple[str, list[Problem]]]:
        return type(self), (str(self), self.problems)


class RecordingError(TwinError):
    """A recording that cannot be read, written or compared."""


class RunError(TwinError):
    """A run that started and failed before its end."""

    run: Run
    """The run up to the failure."""

    def __init__(self, message: str, run: Run) -> None:
        super().__init__(message)
        self.run = run

    def __reduce__(self) -> tuple[type[RunError], tuple[str, Run]]:
        return type(self), (str(self), self.run)


class ScenarioWarning(UserWarning):
    """A value of a scenario that is accepted and probably a mistake."""

    run: Run | None = None
    """The run, where `twinrig.run` raises the warning as an exception."""
