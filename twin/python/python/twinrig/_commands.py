"""Functions of the package: commands of the program `twin`, for Python."""

from __future__ import annotations

import json
import os
import pathlib
import warnings
from collections.abc import Iterable, Mapping
from typing import Any

from twinrig import _native
from twinrig._errors import RecordingError, RunError, ScenarioError, ScenarioWarning, TwinError
from twinrig._parts import PartSource, sources
from twinrig._run import Page, Recording, Run
from twinrig._scenario import Path, Scenario, file_of, native, path_of, settings


def _recording_place(record: Path | None) -> tuple[str, bool] | None:
    """Return the path of a recording and whether it is a folder."""
    if record is None:
        return None
    path = path_of(record, "record")
    return path, os.path.isdir(path) or not path.endswith(".mcap")


def run(
    scenario: Scenario,
    *,
    set: Mapping[str, Any] | None = None,
    plant: str | None = None,
    seed: int | None = None,
    record: Path | None = None,
    signals: Iterable[str] | None = None,
    controllers: Mapping[str, PartSource] | None = None,
    plants: Mapping[str, PartSource] | None = None,
) -> Run:
    """Run a scenario in virtual time and judge it, as ``twin run`` does with the same settings.

    Parameters
    ----------
    scenario
        Path of a scenario file, or its tables as a dictionary; robots and paths in a dictionary
        are relative to the current folder.
    set
        Settings by dotted key: ``{"controller.frequency": "3.2 Hz"}``. Strings are read as on the
        command line; numbers, booleans, lists and dictionaries are taken as they are.
    plant
        Model of the plant, short for ``set={"plant.model": …}``.
    seed
        Seed of all random streams, 0 or greater.
    record
        Path of the recording (``….mcap``), or folder for one with the name that the program gives
        it; by default nothing is recorded.
    signals
        Names of the signals to keep, with ``*`` and ``**``; short for ``record.signals``. By
        default those of ``[record]``, which are all. They are in memory: 8 bytes a value.
    controllers, plants
        Controllers and plants in Python by the names under which the scenario refers to them, as
        ``kind`` of ``[controller]`` and ``model`` of ``[plant]``: classes, functions or objects,
        see `twinrig.Controller` and `twinrig.Plant`.

    Returns
    -------
    Run
        Also where an expectation fails: see `Run.verdict`.

    Raises
    ------
    ScenarioError
        The scenario has mistakes, or a part cannot be built.
    RunError
        The run started and failed; `RunError.run` is the run up to there.
    RecordingError
        The recording cannot be written.
    MemoryError
        The signals do not fit into memory.
    KeyboardInterrupt
        The run was interrupted. Its attribute `run` is the run up to there, and a recording is
        complete up to there.
    ScenarioWarning
        Where a filter makes exceptions of warnings: after the run, as its attribute `run`, unless
        the run itself has failed.
    Exception
        Any that a controller or plant in Python raises, with the same attribute `run`.

    Notes
    -----
    Other Python threads continue meanwhile; runs in several threads run in parallel, and the
    results do not depend on it.
    """
    arguments = native(scenario, set=set, plant=plant, seed=seed, signals=signals)
    python_parts = sources(controllers, "controllers"), sources(plants, "plants")
    raw = _native.run(arguments, _recording_place(record), *python_parts)
    finished = Run(raw)
    interrupt = raw["interrupt"]
    failure: BaseException | None = None
    if interrupt is not None:
        interrupt.run = finished
        if finished.error is not None and hasattr(interrupt, "add_note"):
            interrupt.add_note(finished.error)
        failure = interrupt
    elif finished.error is not None:
        failure = RunError(finished.error, finished)
    for _, text in raw["warnings"]:
        try:
            warnings.warn(text, ScenarioWarning, stacklevel=2)
        except ScenarioWarning as warning:
            # A filter makes exceptions of warnings, which must not hide the run or its failure.
            warning.run = finished
            failure = failure or warning
    if failure is not None:
        raise failure
    return finished


def check(
    scenario: Scenario,
    *,
    set: Mapping[str, Any] | None = None,
    plant: str | None = None,
    strict: bool = False,
) -> dict[str, Any]:
    """Check a scenario without running it.

    Returns the object that ``twin check --json`` prints: `file`, `scenario` (its name), `valid`,
    `error`, `warnings`; and `problems`, a list of `Problem`. With `strict`, a scenario with
    warnings is not valid.
    """
    arguments = native(scenario, set=set, plant=plant)
    result: dict[str, Any] = {"file": arguments[0], "scenario": None, "valid": False}
    try:
        name, warned = _native.check(arguments)
    except ScenarioError as error:
        return {**result, "error": str(error), "warnings": [], "problems": error.problems}
    keys = ("code", "message", "file", "line")
    listed = [dict(zip(keys, warning, strict=True)) for warning in warned]
    refused = "\n\n".join(text for _, text, _, _ in warned) if strict and warned else None
    result |= {"scenario": name, "valid": refused is None, "error": refused}
    return {**result, "warnings": listed, "problems": []}


def plan(
    scenario: Scenario, *, set: Mapping[str, Any] | None = None, plant: str | None = None
) -> dict[str, Any]:
    """Return the parts of a scenario, and the omitted ones with the reason, without running it.

    The object is that of ``twin plan --json``: schedule, signals with units and sizes, wires,
    expectations and others.
    """
    found: dict[str, Any] = json.loads(_native.plan(native(scenario, set=set, plant=plant)))
    return found


def command_json(
    words: list[str], error: type[TwinError], result: str | None = None
) -> dict[str, Any]:
    """Run a command of the program that prints one JSON object.

    An object with the key `result` is a result also where the command failed.
    """
    code, out, err = _native.command(words)
    if not out.strip():
        # The command line was refused.
        raise ValueError(err.strip() or f"the command {words[0]} ended with code {code}")
    found: dict[str, Any] = json.loads(out)
    if code == 2 and found.get("error") and (result is None or result not in found):
        raise error(found["error"])
    return found


def option(name: str, value: object) -> list[str]:
    if value is None:
        return []
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        kind = type(value).__name__
        raise TypeError(f"{name}: expected a number or a string with a unit, not {kind}")
    # With `=`, a value that begins with `-` is not taken for an option.
    return [f"--{name}={value}"]


def page(of: Run | Recording | Path, *, out: Path | None = None) -> Page:
    """Write the page of a run, as ``twin report`` does; a notebook shows it.

    Parameters
    ----------
    of
        A run with a recording, a recording, or its path.
    out
        Page to write; by default beside the recording, with the ending ``html``.

    Raises
    ------
    ValueError
        The run has no recording: `run` makes one with ``record=…``.
    RecordingError
        The recording cannot be read, or the page cannot be written.
    """
    if isinstance(of, (Run, Recording)):
        found = of.recording if isinstance(of, Run) else of.path
        if found is None:
            raise ValueError("the run has no recording: run it with record=…")
        of = found
    words = ["report", "--json"]
    if out is not None:
        words.append(f"--out={path_of(out, 'out')}")
    written = command_json([*words, "--", path_of(of, "of")], RecordingError)
    return Page(pathlib.Path(written["page"]))


def diff(
    a: Path,
    b: Path,
    *,
    events: bool = False,
    time: str | None = None,
    place: str | None = None,
    share: str | float | None = None,
) -> dict[str, Any]:
    """Compare two recordings, as ``twin diff --json`` does.

    Without `events` bit for bit: `identical`, `first` (the first difference) and others. With
    `events` footstep by footstep, within the tolerances `time` (``"5 ms"``), `place` (``"5 mm"``)
    and `share` (of the range of a signal).

    Raises
    ------
    RecordingError
        A recording cannot be read, or they have no sample in common.
    """
    words = ["diff", "--json"]
    if events:
        words.append("--events")
    for name, value in (("time", time), ("place", place), ("share", share)):
        words += option(name, value)
    return command_json([*words, "--", path_of(a, "a"), path_of(b, "b")], RecordingError)


def study(
    kind: str,
    scenario: Scenario | None = None,
    *,
    plants: Iterable[str] = (),
    set: Mapping[str, Any] | None = None,
    duration: str | None = None,
    budget: float | None = None,
    out: Path = "studies",
    ensemble: int | None = None,
    particles: int | None = None,
    iterations: int | None = None,
) -> dict[str, Any]:
    """Measure plants and methods, as ``twin study KIND --json`` does, and return its object.

    Parameters
    ----------
    kind
        Name of the study: ``precision``, ``stability`` and others, which ``twin study --help``
        lists.
    scenario
        Path of a scenario file, or its tables as a dictionary, which is written to the current
        folder; by default that of the kind.
    plants
        Models to study; by default all of this build.
    set
        Settings, as in `run`.
    duration
        Simulated time: ``"300 ms"``.
    budget
        Approximate limit of the computing time [s], 200 by default.
    out
        Folder for the page, the CSV and the JSON file.
    ensemble
        Walks from perturbed starts (``precision``).
    particles, iterations
        Size of the swarms (``estimate``).
    """
    if not isinstance(kind, str):
        raise TypeError(f"kind: expected a string, not {type(kind).__name__}")
    if isinstance(plants, str):
        raise TypeError("plants: expected a list of models, not a string")
    words = ["study", kind, "--json", f"--out={path_of(out, 'out')}"]
    for plant in plants:
        words += option("plant", plant)
    words += [f"--set={name}={value}" for name, value in settings(set)]
    sizes = (("ensemble", ensemble), ("particles", particles), ("iterations", iterations))
    for name, value in (("duration", duration), ("budget", budget), *sizes):
        words += option(name, value)
    if scenario is not None:
        words += ["--", file_of(scenario, "scenario")]
    return command_json(words, TwinError)


def command(name: str, /, *arguments: Scenario, **options: Any) -> Any:
    """Run any command of the program, and return what it prints.

    >>> twinrig.command("export", "fmu", "scenarios/trot.toml", out="trot.fmu")
    'written trot.fmu: FMI 2.0, plant with 24 inputs and 109 outputs'
    >>> twinrig.command("replay", "recordings/trot-seed1.mcap", json=True)["identical"]
    True

    Parameters
    ----------
    name
        Name of the command: ``export``, ``import``, ``draw``, ``cell``, ``thesis``, ``replay``,
        ``serve`` and others, which ``twin --help`` lists.
    arguments
        Its arguments: words, paths, and scenarios also as dictionaries, which are written to files
        ``scenario-….toml`` in the current folder.
    options
        Its options, with ``_`` in place of ``-``: ``no_record=True`` is ``--no-record``. A list
        repeats the option; ``set`` is a dictionary, as of `run`.

    Returns
    -------
    str or dict
        The text without colours, or with ``json=True`` the object.

    Raises
    ------
    TwinError
        The command ended with an error, with exit code 2. A comparison or verdict that fails is
        none.
    """
    places = [file_of(argument, name) for argument in arguments]
    # A path that begins with `-` is not taken for an option.
    words = [name, *(f"./{place}" if place.startswith("-") else place for place in places)]
    for key, value in options.items():
        words += _option_words(key.rstrip("_").replace("_", "-"), value)
    if options.get("json") is True:
        return command_json(words, TwinError, "verdict")
    code, out, err = _native.command(words)
    if code == 2:
        raise TwinError(err.strip() or f"the command {name} ended with code {code}")
    return out.removesuffix("\n")


def _option_words(name: str, value: object) -> list[str]:
    """Return an option of the command line, which a list repeats."""
    if isinstance(value, bool):
        return [f"--{name}"] if value else []
    if name == "set" and isinstance(value, Mapping):
        return [f"--set={key}={text}" for key, text in settings(value)]
    if isinstance(value, os.PathLike):
        return [f"--{name}={path_of(value, name)}"]
    if isinstance(value, Iterable) and not isinstance(value, (str, Mapping)):
        return [word for each in value for word in _option_words(name, each)]
    return option(name, value)


def parts(robot: Path = "cheetah-cub") -> dict[str, Any]:
    """Return plants, controllers, buses and robots of this build with their settings.

    The object is that of ``twin list --json``, with the process variables of `robot` and, as
    ``robot``, what follows from its file.
    """
    return command_json(["list", "--json", "--", path_of(robot, "robot")], TwinError)


def robots() -> list[str]:
    """Return the names of the robots that scenarios in the current folder can use."""
    found: list[str] = parts()["robots"]
    return found


def read(recording: Path) -> Recording:
    """Read a recording into memory; one that was cut off, up to its last complete sample.

    Raises
    ------
    RecordingError
        The file cannot be read, or is not a recording.
    """
    path = path_of(recording, "recording")
    return Recording(path, _native.read(path))
