"""Scenario files and their expectations as collectors and tests of pytest."""

from __future__ import annotations

import os
import re
import shlex
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import twinrig

import pytest_twinrig

if TYPE_CHECKING:
    from _pytest._code.code import ExceptionInfo, TerminalRepr

EXPECT = re.compile(r"^\s*\[\[\s*expect\s*\]\]")

RUNS = "runs"
"""Name of the test of a scenario without expectations."""


class ExpectationFailed(Exception):
    """An expectation does not hold; the text is the report."""


@dataclass(frozen=True)
class Outcome:
    """Parts of a run that its tests report. They last for the session, unlike its signals."""

    report: dict[str, Any]
    expectations: list[twinrig.Expectation]
    table: str
    recording: Path | None
    fingerprint: str

    @classmethod
    def of(cls, run: twinrig.Run) -> Outcome:
        """Return the outcome of a run."""
        return cls(run.report, run.expectations, str(run), run.recording, run.fingerprint)


class ScenarioRun:
    """A scenario on one plant: its settings and, once a test needs it, its run."""

    def __init__(self, path: Path, config: pytest.Config, plant: str | None) -> None:
        self.path = path
        self.plant = plant
        self.set = dict(text.split("=", 1) for text in pytest_twinrig.settings(config))
        self.recordings = pytest_twinrig.recordings(config)
        self._result: Outcome | BaseException | None = None
        self._base = config.invocation_params.dir
        # From this folder the user repeats the command.
        self.shown = short(path, self._base)
        self._own_folder = ""

    def _path(self) -> str | Path:
        """Return a path that is right also where a test has changed the current folder."""
        return self.shown if Path.cwd() == self._base else self.path

    def names(self) -> list[str]:
        """Return the names of the expectations that apply to this plant.

        Raises `twinrig.ScenarioError` for a scenario with mistakes.
        """
        names: list[str] = twinrig.plan(self._path(), set=self.set, plant=self.plant)[
            "expectations"
        ]
        return names

    def result(self) -> Outcome:
        """Run the scenario at the first call; return or raise the result at every call."""
        if self._result is None:
            try:
                self._result = self._run()
            except Exception as error:
                if isinstance(error, twinrig.RunError):
                    # Without its signals, as a run that has not failed.
                    error = twinrig.TwinError(str(error))
                self._result = error
        if isinstance(self._result, BaseException):
            # Without the frames of former calls, which would add up.
            raise self._result.with_traceback(None)
        return self._result

    def _run(self) -> Outcome:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            if self.recordings is None:
                run = twinrig.run(self._path(), set=self.set, plant=self.plant)
            else:
                run = self._recorded(self.recordings)
        self._warn(run.report["warnings"], caught)
        return Outcome.of(run)

    def _recorded(self, folder: Path) -> twinrig.Run:
        folder = Path(short(folder, Path.cwd()))
        folder.mkdir(parents=True, exist_ok=True)
        if "PYTEST_XDIST_WORKER" not in os.environ:
            return twinrig.run(self._path(), set=self.set, plant=self.plant, record=folder)
        # Two workers may run one scenario: neither must write into the file of the other.
        with tempfile.TemporaryDirectory(dir=folder, prefix=".recording-") as own:
            self._own_folder = own
            self.recordings = folder
            run = twinrig.run(self._path(), set=self.set, plant=self.plant, record=own)
            if run.recording is not None:
                run.recording = run.recording.replace(folder / run.recording.name)
        return run

    def _warn(
        self, found: Iterable[dict[str, Any]], caught: Iterable[warnings.WarningMessage]
    ) -> None:
        """Repeat warnings with their places in the scenario instead of that in this file."""
        for one in caught:
            text = str(one.message)
            place: dict[str, Any] = next((at for at in found if at["message"] in text), {})
            name, line = place.get("file") or self.shown, place.get("line") or 1
            warnings.warn_explicit(text, one.category, name, line)

    def table(self) -> str:
        """Return the table of the program."""
        table = self.result().table.rstrip()
        # A recording that was moved is shown at its place.
        return table.replace(self._own_folder, str(self.recordings)) if self._own_folder else table

    def command(self) -> str:
        """Return the command that repeats the run."""
        words = ["twin", "run", self.shown]
        for name, value in self.set.items():
            words += ["--set", f"{name}={value}"]
        if self.plant is not None:
            words += ["--plant", self.plant]
        return shlex.join(words)


class ScenarioFile(pytest.File):
    """A scenario file; its tests share one run for each plant."""

    def collect(self) -> Iterator[ExpectationItem]:
        """Yield a test for each expectation, on each plant."""
        lines = self._lines()
        chosen: list[str | None] = [*pytest_twinrig.plants(self.config)]
        for plant in chosen or [None]:
            run = ScenarioRun(self.path, self.config, plant)
            try:
                names = run.names()
            except twinrig.ScenarioError as error:
                skip_if_absent(run, error)
                raise
            seen: Counter[str] = Counter()
            for index, name in enumerate(names or [RUNS]):
                seen[name] += 1
                # With expectations left out, lines and names do not correspond.
                line = lines[index] if names and len(lines) == len(names) else None
                yield ExpectationItem.from_parent(
                    self,
                    name=test_name(name, seen[name], plant),
                    run=run,
                    index=index if names else None,
                    line=line,
                )

    def _lines(self) -> list[int]:
        """Return the lines of the tables `[[expect]]`, counted from 0."""
        text = self.path.read_text(encoding="utf-8", errors="replace")
        return [at for at, line in enumerate(text.splitlines()) if EXPECT.match(line)]

    def repr_failure(  # type: ignore[override]  # as `pytest.Collector` has it
        self, excinfo: ExceptionInfo[BaseException]
    ) -> str | TerminalRepr:
        """Show the message of the program for a scenario with mistakes."""
        if isinstance(excinfo.value, twinrig.TwinError):
            return str(excinfo.value)
        return super().repr_failure(excinfo)


class ExpectationItem(pytest.Item):
    """An expectation of a scenario on one plant."""

    def __init__(
        self, *, run: ScenarioRun, index: int | None, line: int | None, **rest: Any
    ) -> None:
        super().__init__(**rest)
        self.scenario_run = run
        self.index = index
        self.line = line
        if self.config.pluginmanager.hasplugin("xdist"):
            # With `--dist loadgroup`, one worker has all tests of a run.
            self.add_marker(pytest.mark.xdist_group(f"{run.shown}[{run.plant}]"))

    def setup(self) -> None:
        """Run the scenario, unless another test has.

        A run without an answer is an error of pytest, not a failure.
        """
        try:
            self.scenario_run.result()
        except (twinrig.TwinError, twinrig.ScenarioWarning) as error:
            pytest.fail(f"{error}\n\nrepeat: {self.scenario_run.command()}", pytrace=False)

    def runtest(self) -> None:
        """Judge the expectation as the program does."""
        run = self.scenario_run.result()
        self.user_properties.append(("fingerprint", run.fingerprint))
        if self.index is None:
            return
        found = run.expectations[self.index]
        numbers = ("measured", "bound", "other_bound", "margin")
        for name in numbers:
            if getattr(found, name) is not None:
                self.user_properties.append((name, getattr(found, name)))
        self.user_properties.append(("unit", found.unit))
        if not found.holds:
            raise ExpectationFailed(self._report(run, found))
        if found.verdict == "unobserved":
            pytest.skip(f"unobserved, and optional: {found.detail}")

    def _report(self, run: Outcome, found: twinrig.Expectation) -> str:
        of_run = self.scenario_run
        # The summary of pytest shows the first line.
        lines = [sentence(found), "", of_run.table(), "", f"repeat: {of_run.command()}"]
        if run.recording is not None:
            lines.append(f"recording: {run.recording}")
        return "\n".join(lines)

    def repr_failure(
        self, excinfo: ExceptionInfo[BaseException], style: Any = None
    ) -> str | TerminalRepr:
        """Show the report of an expectation without a traceback."""
        if isinstance(excinfo.value, ExpectationFailed):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Return the place of the expectation."""
        return self.path, self.line, self.name


def short(path: Path, base: Path) -> str:
    """Return a path relative to a folder that it is in."""
    return os.path.relpath(path, base) if path.is_relative_to(base) else str(path)


def skip_if_absent(run: ScenarioRun, error: twinrig.ScenarioError) -> None:
    """Skip a scenario whose own plant is one that this build leaves out.

    A plant that was chosen for all scenarios must exist.
    """
    absent = [kind for kind in twinrig.parts()["plants"] if kind["remedy"]]
    for kind in absent:
        text = f"this build has no plant `{kind['name']}`"
        if run.plant is None and any(text in problem.message for problem in error.problems):
            pytest.skip(f"{run.shown}: {text}", allow_module_level=True)


def test_name(expectation: str, count: int, plant: str | None) -> str:
    """Return the name of a test; `count` is 2 for the second expectation of the name."""
    # `::` separates the parts of an id, which is a line.
    name = " ".join(expectation.replace("::", ":").split())
    if count > 1:
        name += f"#{count}"
    return name if plant is None else f"{name}[{plant}]"


def sentence(found: twinrig.Expectation) -> str:
    """Return the outcome of an expectation that does not hold, as a line."""
    parts = [found.verdict]
    unit = "" if found.unit == "1" else f" {found.unit}"
    if found.measured is not None and found.bound is not None:
        parts.append(f"measured {found.measured:.6g}{unit}, bound {found.bound:.6g}{unit}")
    if found.margin is not None:
        parts.append(f"margin {found.margin:.3g}{unit}")
    if found.first_violation_s is not None:
        parts.append(f"first at {found.first_violation_s:.3f} s")
    if found.detail:
        parts.append(found.detail)
    return ", ".join(parts)
