"""Arguments that select a scenario and its settings."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias, Union

from twinrig import _toml

Path: TypeAlias = Union[str, "os.PathLike[str]"]
Scenario: TypeAlias = Union[Path, Mapping[str, Any]]
"""Path of a scenario file, or its tables as a dictionary."""

Native: TypeAlias = tuple[str, Union[str, None], list[tuple[str, str, str]]]
"""Path or name, text, and settings (origin, key, value) of a scenario."""

TEXT_NAME = "<scenario>"
"""Name of a scenario without a file, in messages."""


def path_of(path: Path, argument: str) -> str:
    """Return a path as a string."""
    if not isinstance(path, (str, os.PathLike)):
        raise TypeError(f"{argument}: expected a path, not {type(path).__name__}")
    text = os.fspath(path)
    if not isinstance(text, str):
        raise TypeError(f"{argument}: expected a path that is a string, not bytes")
    if "\0" in text:
        raise ValueError(f"{argument}: a path has no null character: {text!r}")
    return text


def file_of(
    tables: Scenario, argument: str, folder: str = "", name: str = "scenario-{}.toml"
) -> str:
    """Return the path of a file; that of a dictionary is written, for commands that read files.

    Its name has a hash of the tables, so that a search or sweep is continued with the same file,
    and the commands in results, which repeat a run, find it. Robots and paths of a scenario are
    relative to the current folder, and so is its file.
    """
    if not isinstance(tables, Mapping):
        return path_of(tables, argument)
    text = _toml.document(tables).encode()
    path = os.path.join(folder, name.format(hashlib.sha256(text).hexdigest()[:16]))
    os.makedirs(folder or ".", exist_ok=True)
    # Replaced as a whole: another process may read it.
    with tempfile.NamedTemporaryFile(dir=folder or ".", delete=False) as file:
        file.write(text)
    os.replace(file.name, path)
    return path


def settings(values: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """Return keys and values of the argument `set`, the values as on the command line."""
    if values is None:
        return []
    if not isinstance(values, Mapping):
        raise TypeError(f"set: expected a dictionary, not {type(values).__name__}")
    pairs = []
    for name, value in values.items():
        if not isinstance(name, str):
            raise TypeError(f"set: a key must be a string, not {type(name).__name__}: {name!r}")
        text = value if isinstance(value, str) else _toml.inline(value, f"set[{name!r}]")
        pairs.append((_toml.encodable(name), _toml.encodable(text)))
    return pairs


def native(
    scenario: Scenario,
    *,
    set: Mapping[str, Any] | None = None,
    plant: str | None = None,
    seed: int | None = None,
    signals: Iterable[str] | None = None,
) -> Native:
    """Return the arguments of a function of `_native`.

    A scenario as a dictionary is written as TOML first, so that its mistakes are shown with
    line and caret, too.
    """
    chosen: list[tuple[str, str, str]] = []
    if plant is not None:
        if not isinstance(plant, str):
            raise TypeError(f"plant: expected a string, not {type(plant).__name__}")
        chosen.append(("plant=", "plant.model", _toml.string(plant)))
    chosen.extend(("set=", name, value) for name, value in settings(set))
    if seed is not None:
        if isinstance(seed, bool) or not hasattr(seed, "__index__"):
            raise TypeError(f"seed: expected an integer, not {type(seed).__name__}")
        chosen.append(("seed=", "seed", int.__repr__(seed.__index__())))
    if signals is not None:
        if isinstance(signals, str) or not isinstance(signals, Iterable):
            raise TypeError(f"signals: expected a list of names, not {type(signals).__name__}")
        names = list(signals)
        for name in names:
            if not isinstance(name, str):
                raise TypeError(f"signals: expected names, not {type(name).__name__}: {name!r}")
        chosen.append(("signals=", "record.signals", _toml.inline(names, "signals")))
    if isinstance(scenario, Mapping):
        return TEXT_NAME, _toml.document(scenario), chosen
    return path_of(scenario, "scenario"), None, chosen
