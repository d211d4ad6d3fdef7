"""Writing of TOML: scenarios made of dictionaries, and settings made of Python values.

A value has one line, so that a message about it shows all of it. Tables of a scenario have
headers, and the keys of a table a line each, as people write them.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from typing import Any

BARE_KEY = re.compile(r"[A-Za-z0-9_-]+\Z")
"""Keys that TOML takes without quotes."""

DEPTH_MAX = 50
"""Greatest depth of values within values; a list that contains itself has no end."""


def key(name: object) -> str:
    """Return a key, quoted where that is necessary."""
    if not isinstance(name, str):
        raise TypeError(f"a key must be a string, not {type(name).__name__}: {name!r}")
    return name if BARE_KEY.match(name) else string(name)


def encodable(text: str) -> str:
    """Return the text itself, if UTF-8 can encode it."""
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ValueError(f"not a text that UTF-8 can encode: {text!r}") from None
    return text


def string(text: str) -> str:
    """Return a basic string."""
    escaped = encodable(text).replace("\\", "\\\\").replace('"', '\\"')
    return '"' + re.sub(r"[\x00-\x1f\x7f]", lambda at: f"\\u{ord(at[0]):04x}", escaped) + '"'


def inline(value: object, place: str, depth: int = 0) -> str:
    """Return a value in one line; `place` names it in errors."""
    if depth > DEPTH_MAX:
        raise ValueError(f"{place}: values within values, deeper than {DEPTH_MAX} levels")
    # Scalars and arrays of NumPy, and what else converts itself.
    if not isinstance(value, (str, bytes)) and hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return string(value)
    if isinstance(value, int):
        return int.__repr__(value)
    if isinstance(value, float):
        return float.__repr__(value)  # TOML writes infinities and NaN as Python does.
    if isinstance(value, os.PathLike):
        return string(os.fsdecode(value))
    if isinstance(value, Mapping):
        entries = (f"{key(name)} = {inline(of, place, depth + 1)}" for name, of in value.items())
        return "{ " + ", ".join(entries) + " }" if value else "{}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(inline(of, place, depth + 1) for of in value) + "]"
    raise TypeError(
        f"{place}: {type(value).__name__} is not a value of a scenario; expected a string, a "
        "number, a boolean, a list or a dictionary"
    )


def _is_tables(value: object) -> bool:
    return (
        isinstance(value, (list, tuple))
        and len(value) > 0
        and all(isinstance(of, Mapping) for of in value)
    )


def document(table: Mapping[str, Any]) -> str:
    """Return the text of a scenario."""
    return "\n".join(_lines(table, ())) + "\n"


def _lines(table: Mapping[str, Any], path: tuple[str, ...]) -> Iterable[str]:
    if len(path) > DEPTH_MAX:
        raise ValueError(f"{path[0]}: tables within tables, deeper than {DEPTH_MAX} levels")
    # Keys of a table precede the tables in it: after a header, a key belongs to that header.
    for name, value in table.items():
        if not isinstance(value, Mapping) and not _is_tables(value):
            yield f"{key(name)} = {inline(value, '.'.join((*path, str(name))))}"
    for name, value in table.items():
        inner = (*path, key(name))
        if isinstance(value, Mapping):
            yield f"\n[{'.'.join(inner)}]"
            yield from _lines(value, inner)
        elif _is_tables(value):
            for of in value:
                yield f"\n[[{'.'.join(inner)}]]"
                yield from _lines(of, inner)
