"""Sweeps and searches: many runs, and assertions about their shares."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from twinrig._commands import command_json, option
from twinrig._errors import TwinError
from twinrig._html import table
from twinrig._scenario import Path, Scenario, file_of, path_of, settings

Column = Union[npt.NDArray[np.float64], npt.NDArray[np.str_]]

TEXTS = ("verdict", "fingerprint", "key", "error")
"""Columns of texts; also those of the verdicts of expectations."""


@dataclass(frozen=True)
class Share:
    """An asserted share of the runs, with Wilson's score interval."""

    of: str
    """Name of an expectation, or ``verdict``."""
    held: int
    """Runs in which it holds."""
    runs: int
    share: float | None
    low: float | None
    """Lower end of the interval."""
    high: float | None
    """Upper end."""
    confidence: float
    min: float | None
    max: float | None
    verdict: str
    """``pass``, ``fail`` or ``undecided``: the interval contains a bound."""


class Sweep:
    """Results of a sweep: an ordinary object, which can be pickled."""

    report: dict[str, Any]
    """The object that ``twin sweep --json`` prints."""
    name: str
    verdict: str
    """``pass``, ``fail``, ``undecided``, ``partial``, ``interrupted`` or ``error``."""
    hash: str | None
    """Hash of all points and fingerprints, 64 digits; ``None`` while points are missing."""
    shares: list[Share]
    counts: dict[str, int]
    """Numbers of runs: `points`, and of them `pass`, `fail`, `error`, `missing`."""
    rows: list[dict[str, Any]]
    """A run each: `point`, `verdict`, `expectations`, `fingerprint`, `command` and others."""
    folder: FilePath
    """Folder with ``report.html``, ``rows.csv`` and ``sweep.json``, as an absolute path."""

    def __init__(self, report: dict[str, Any], folder: FilePath) -> None:
        self.report, self.folder = report, folder.absolute()
        self.name, self.verdict, self.hash = report["sweep"], report["verdict"], report["hash"]
        self.shares = [Share(**share) for share in report["shares"]]
        self.counts, self.rows = report["counts"], report["rows"]
        # Another sweep into the folder replaces the file.
        self._columns = {} if self.counts["missing"] else _columns(self.folder / "rows.csv")

    def columns(self) -> dict[str, Column]:
        """Return the columns of ``rows.csv``, each of shape (points,).

        Numbers are float64, NaN where there is none; texts are strings. ``pandas.DataFrame`` takes
        the dictionary as it is.
        """
        if self.counts["missing"]:
            raise TwinError(f"{self.counts['missing']} runs of the sweep are missing: run it again")
        return {name: column.copy() for name, column in self._columns.items()}

    def to_parquet(self, path: Path) -> None:
        """Write the columns as a Parquet file, which requires the package `pyarrow`."""
        try:
            from pyarrow import parquet
            from pyarrow import table as arrow_table
        except ImportError as error:
            raise ImportError("Parquet requires pyarrow: pip install pyarrow") from error
        parquet.write_table(arrow_table(self.columns()), path_of(path, "path"))

    def __repr__(self) -> str:
        return f"<Sweep {self.name!r}: {self.verdict}, {self.counts['points']} points>"

    def _repr_html_(self) -> str:
        rows = (
            (each.of, each.verdict, f"{each.held} of {each.runs}", each.share, each.low, each.high)
            for each in self.shares
        )
        counts = ", ".join(f"{number} {name}" for name, number in self.counts.items())
        head = ("share of", "verdict", "holds", "share", "low", "high")
        return table(f"{self.name}: {self.verdict}; {counts}", head, rows)


def _columns(path: FilePath) -> dict[str, Column]:
    with path.open(encoding="utf-8", newline="") as file:
        names, *rows = csv.reader(file)
    return {name: _column(name, cells) for name, cells in zip(names, zip(*rows), strict=True)}


def _column(name: str, cells: tuple[str, ...]) -> Column:
    if name in TEXTS or name.endswith(": verdict"):
        return np.array(cells, dtype=np.str_)
    try:
        return np.array([float(cell) if cell else np.nan for cell in cells])
    except ValueError:
        return np.array(cells, dtype=np.str_)


def sweep(
    scenario: Scenario,
    spec: Path | Mapping[str, Any],
    *,
    set: Mapping[str, Any] | None = None,
    plant: str | None = None,
    engine: str = "local",
    address: str | None = None,
    jobs: int | None = None,
    partition: str | None = None,
    out: Path | None = None,
    record: Path | None = None,
    junit: Path | None = None,
) -> Sweep:
    """Run a scenario at many points, on all processors, as ``twin sweep`` does.

    Parameters
    ----------
    scenario
        Path of a scenario file, or its tables as a dictionary, as of `twinrig.run`; that is written
        to a file ``scenario-….toml`` in the current folder, which the results name.
    spec
        Path of a specification, or its tables as a dictionary: dimensions, design and shares.
    set, plant
        As of `twinrig.run`, for all runs.
    engine
        ``"local"``: threads of this process; ``"ray"``: the workers of a Ray cluster. Without
        influence on the results.
    address
        Ray cluster: ``"auto"``, the one that this machine belongs to, or ``"HOST:PORT"``; by
        default a Ray of its own on this machine, or the one in ``RAY_ADDRESS``.
    jobs
        Runs at the same time, without influence on the results; by default all processors, or
        all CPUs of the cluster.
    partition
        ``"1/3"``: every third point, beginning with the first, on one of three machines.
    out
        Folder of the results and of the store, from which an interrupted sweep continues; by
        default ``sweeps/`` and the name of the specification.
    record
        Folder for a recording of each run, on the machine of the run; ``recordings.csv`` in `out`
        lists them.
    junit
        File for the verdicts as JUnit XML.

    Raises
    ------
    TwinError
        The scenario or the specification has mistakes, a file cannot be written, or the cluster is
        lost, whose rows up to then are kept. Runs that
        fail are no exception: the verdict is ``error``, and their rows have the `error`.
    KeyboardInterrupt
        The sweep was interrupted; the same call continues it.
    """
    words = ["sweep", "--json", *_engine_words(set, plant, engine, address, jobs)]
    words += option("partition", partition)
    for name, path in (("record", record), ("junit", junit)):
        if path is not None:
            words.append(f"--{name}={path_of(path, name)}")
    folder = _folder(out, "sweeps", spec, "spec")
    file = file_of(spec, "spec", str(folder), "sweep.toml")
    words += [f"--out={folder}", "--", file_of(scenario, "scenario"), file]
    return Sweep(command_json(words, TwinError, "rows"), folder)


def optimize(
    scenario: Scenario,
    space: Path | Mapping[str, Any],
    *,
    set: Mapping[str, Any] | None = None,
    plant: str | None = None,
    particles: int | None = None,
    iterations: int | None = None,
    seed: int | None = None,
    engine: str = "local",
    address: str | None = None,
    jobs: int | None = None,
    out: Path | None = None,
) -> dict[str, Any]:
    """Search the settings with the best value of an expectation, as ``twin optimize`` does.

    Returns the object of ``twin optimize --json``; the folder `out` then has the scenario with the
    best settings, ``best.toml``, the history, and the points.

    Parameters
    ----------
    scenario, set, plant, engine, address, jobs
        As of `sweep`.
    space
        Path of a search space, or its tables as a dictionary: dimensions, objective, method.
    particles, iterations, seed
        In place of those of the search space.
    out
        Folder of the results and of the rows, from which an interrupted search continues; by
        default ``optimizations/`` and the name of the search space.

    Raises
    ------
    TwinError
        The scenario or the search space has mistakes, or a file cannot be written.
    KeyboardInterrupt
        The search was interrupted; the same call continues it.
    """
    words = ["optimize", "--json", *_engine_words(set, plant, engine, address, jobs)]
    for name, number in (("particles", particles), ("iterations", iterations), ("seed", seed)):
        words += option(name, number)
    folder = _folder(out, "optimizations", space, "space")
    # With a hash: the folder refuses the results of another search space.
    file = file_of(space, "space", str(folder), "space-{}.toml")
    words += [f"--out={folder}", f"--space={file}", "--", file_of(scenario, "scenario")]
    return command_json(words, TwinError, "verdict")


def _engine_words(
    set: Mapping[str, Any] | None,
    plant: str | None,
    engine: str,
    address: str | None,
    jobs: int | None,
) -> list[str]:
    words = [f"--set={name}={value}" for name, value in settings(set)]
    words += option("plant", plant) + option("engine", engine)
    return words + option("address", address) + option("jobs", jobs)


def _folder(
    out: Path | None, parent: str, tables: Path | Mapping[str, Any], argument: str
) -> FilePath:
    """Return the folder of results: `out`, or that of the name of a specification."""
    if out is not None:
        return FilePath(path_of(out, "out"))
    if isinstance(tables, Mapping):
        return FilePath(parent) / str(tables.get("name", parent.removesuffix("s"))).replace("/", "-")
    return FilePath(parent) / FilePath(path_of(tables, argument)).stem
