"""Values of several variables of an FMU in one buffer of doubles."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from twinrig._fmu._errors import Fault

_DOUBLE_BYTES = 8

# Type of C, and name of the functions that transfer it.
_TYPES: dict[str, tuple[type[Any], str]] = {
    "Real": (ctypes.c_double, "Real"),
    "Integer": (ctypes.c_int, "Integer"),
    "Enumeration": (ctypes.c_int, "Integer"),
    "Boolean": (ctypes.c_int, "Boolean"),
}
_TYPES_3: dict[str, tuple[type[Any], str]] = {
    "Float64": (ctypes.c_double, "Float64"),
    "Float32": (ctypes.c_float, "Float32"),
    "Int8": (ctypes.c_int8, "Int8"),
    "UInt8": (ctypes.c_uint8, "UInt8"),
    "Int16": (ctypes.c_int16, "Int16"),
    "UInt16": (ctypes.c_uint16, "UInt16"),
    "Int32": (ctypes.c_int32, "Int32"),
    "UInt32": (ctypes.c_uint32, "UInt32"),
    "Int64": (ctypes.c_int64, "Int64"),
    "UInt64": (ctypes.c_uint64, "UInt64"),
    "Enumeration": (ctypes.c_int64, "Int64"),
    "Boolean": (ctypes.c_bool, "Boolean"),
}


@dataclass
class _Group:
    """Variables that one function transfers."""

    get: Callable[..., int]
    set: Callable[..., int]
    references: Any
    values: Any
    positions: list[int]
    """Places of the values in the buffer of doubles."""
    names: list[str]
    whole: bool
    """Whether the values are that buffer."""


class Values:
    """Values of variables, one after the other, as bytes of doubles."""

    def __init__(self, fmu: Any, version: int, variables: Sequence[Any]) -> None:
        self._fmu = fmu
        self._counted = version == 3
        types = _TYPES if version == 2 else _TYPES_3
        places: dict[str, list[tuple[Any, int, int]]] = {}
        position = 0
        for variable in variables:
            size = 1
            for extent in variable.shape or ():
                size *= int(extent)
            key = types[variable.type][1]
            places.setdefault(key, []).append((variable, position, size))
            position += size
        self._format = struct.Struct(f"<{position}d")
        self._groups = [self._group(version, types, of_type) for of_type in places.values()]

    def _group(
        self,
        version: int,
        types: dict[str, tuple[type[Any], str]],
        of_type: list[tuple[Any, int, int]],
    ) -> _Group:
        kind, name = types[of_type[0][0].type]
        positions = [at + n for _, at, size in of_type for n in range(size)]
        names = [variable.name for variable, _, size in of_type for _ in range(size)]
        references = [variable.valueReference for variable, _, _ in of_type]
        whole = kind is ctypes.c_double and len(positions) * _DOUBLE_BYTES == self._format.size
        return _Group(
            get=getattr(self._fmu, f"fmi{version}Get{name}"),
            set=getattr(self._fmu, f"fmi{version}Set{name}"),
            references=(ctypes.c_uint * len(references))(*references),
            values=(kind * len(positions))(),
            positions=positions,
            names=names,
            whole=whole,
        )

    def read(self) -> bytes:
        """Read the variables."""
        buffer = [0.0] * (self._format.size // _DOUBLE_BYTES)
        for group in self._groups:
            self._call(group, group.get)
            if group.whole:
                return bytes(group.values)
            for position, value in zip(group.positions, group.values, strict=True):
                buffer[position] = float(value)
        return self._format.pack(*buffer)

    def write(self, values: bytes) -> None:
        """Write the variables."""
        for group in self._groups:
            if group.whole:
                ctypes.memmove(group.values, values, len(values))
            else:
                self._convert(group, self._format.unpack(values))
            self._call(group, group.set)

    def _convert(self, group: _Group, buffer: Sequence[float]) -> None:
        kind = group.values._type_
        for place, position in enumerate(group.positions):
            value = buffer[position]
            if kind in (ctypes.c_double, ctypes.c_float):
                group.values[place] = value
            else:
                group.values[place] = _whole(value, kind, group.names[place])

    def _call(self, group: _Group, function: Callable[..., int]) -> None:
        arguments: list[Any] = [group.references, len(group.references), group.values]
        if self._counted:
            arguments.append(len(group.values))
        function(self._fmu.component, *arguments)


def _whole(value: float, kind: type[Any], name: str) -> int:
    if kind is ctypes.c_bool:
        return value != 0.0
    try:
        whole = round(value)
    except (ValueError, OverflowError):
        raise Fault(name, f"{value} is no whole number") from None
    if kind(whole).value != whole:
        raise Fault(name, f"{value} is out of the range of its type")
    return whole
