"""The model description of an FMU, checked and reduced to the needs of a plant."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy
from fmpy.model_description import ValidationError, read_model_description

from twinrig._fmu._archive import Archive
from twinrig._fmu._errors import Refusal

_ELEMENTS_MAX = 1_000_000
_PROBLEMS_MAX = 5
_BASES = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")

NUMERIC = frozenset(
    {"Real", "Integer", "Boolean", "Enumeration", "Float64", "Float32", "Int8", "UInt8", "Int16"}
    | {"UInt16", "Int32", "UInt32", "Int64", "UInt64"}
)
_FLOATS = frozenset({"Real", "Float64", "Float32"})

# Names become parts of paths.
_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,250}")


@dataclass(frozen=True)
class Model:
    """A model that can be simulated here."""

    description: Any
    """The description as FMPy reads it."""
    version: int
    """Major version of FMI."""
    library: str
    """Name of the binary in the archive."""

    @property
    def co_simulation(self) -> Any:
        """Attributes of the interface."""
        return self.description.coSimulation

    @property
    def missing_state(self) -> str | None:
        """Capability that the FMU lacks for saving its state."""
        if not self.co_simulation.canGetAndSetFMUstate:
            return self._flag("canGetAndSetFMUstate")
        if not self.co_simulation.canSerializeFMUstate:
            return self._flag("canSerializeFMUstate")
        return None

    def _flag(self, name: str) -> str:
        return name if self.version == 2 else name.replace("state", "State")

    def summary(self) -> dict[str, Any]:
        """Description for the native half, whose names are those of its reader."""
        interface, experiment = self.co_simulation, self.description.defaultExperiment
        step = _number(interface.fixedInternalStepSize)
        if step is None and experiment is not None:
            step = _number(experiment.stepSize)
        units = {unit.name: unit for unit in self.description.unitDefinitions}
        numeric = (it for it in self.description.modelVariables if it.type in NUMERIC)
        others = (it for it in self.description.modelVariables if it.type not in NUMERIC)
        return {
            "token": self.description.guid or "",
            "missing_state": self.missing_state,
            "fixed_step": not interface.canHandleVariableCommunicationStepSize,
            "step": step if step is not None and step > 0 else None,
            "once_per_process": bool(interface.canBeInstantiatedOnlyOncePerProcess),
            "variables": [_variable(it, units) for it in numeric],
            "unmapped": [{"name": it.name, "type": it.type} for it in others],
        }


def read(path: Path, archive: Archive) -> Model:
    """Read and check the model description of a checked archive."""
    declared = archive.check_xml()
    if declared is not None:
        _version(declared)  # First: the schema of another version would refuse everything.
    try:
        description: Any = read_model_description(str(path))
    except ValidationError as error:
        problems = [str(problem) for problem in error.problems]
        more = len(problems) - _PROBLEMS_MAX
        text = " | ".join(problems[:_PROBLEMS_MAX])
        raise Refusal(
            f"its model description is not valid: {text}" + (f" | {more} more" if more > 0 else "")
        ) from error
    except Exception as error:  # FMPy lets errors of all kinds through.
        raise Refusal(
            f"its model description cannot be read: {type(error).__name__}: {error}"
        ) from error
    version = _version(str(description.fmiVersion))
    _check_interface(description)
    _check_variables(description)
    _check_outputs(description)
    _check_units(description)
    return Model(description, version, _library(description, version, archive))


def _version(version: str) -> int:
    if version == "2.0":
        return 2
    if version == "3.0" or version.startswith("3.0."):
        return 3
    raise Refusal(f"FMI {version[:20]} is not supported; FMI 2.0 and 3.0 are")


def _check_interface(description: Any) -> None:
    interface = description.coSimulation
    if interface is None:
        kinds = [
            name
            for name, kind in (
                ("model exchange", description.modelExchange),
                ("scheduled execution", description.scheduledExecution),
            )
            if kind is not None
        ]
        raise Refusal(f"it has no co-simulation interface: {' and '.join(kinds) or 'none'} only")
    if not _IDENTIFIER.fullmatch(interface.modelIdentifier or ""):
        raise Refusal(
            f"its model identifier {str(interface.modelIdentifier)[:80]!r} is no identifier of C"
        )


def _check_variables(description: Any) -> None:
    elements = 0
    for variable in description.modelVariables:
        if variable.type == "Clock":
            raise Refusal(f"it has clocks (`{variable.name}`), which are not supported")
        elements += _size(variable)
        if elements > _ELEMENTS_MAX:
            raise Refusal(f"its variables have more than {_ELEMENTS_MAX} elements")
        if variable.type in _FLOATS and variable.start is not None:
            for text in str(variable.start).split():
                _check_start(variable.name, text)


def _check_outputs(description: Any) -> None:
    for output in description.outputs:
        variable = output.variable
        if variable.causality != "output":
            raise Refusal(
                f"its structure has `{variable.name}` as an output, whose causality is "
                f"{variable.causality}"
            )


def _check_units(description: Any) -> None:
    for unit in description.unitDefinitions:
        base = unit.baseUnit
        if base is None:
            continue
        factor, offset = float(base.factor), float(base.offset)
        if not (math.isfinite(factor) and math.isfinite(offset) and factor != 0.0):
            raise Refusal(f"its unit `{unit.name}` has the factor {factor} and offset {offset}")


def _check_start(name: str, text: str) -> None:
    number = _number(text)
    if number is None or not math.isfinite(number):
        raise Refusal(f"the start value {text[:80]!r} of `{name}` is not a finite number")


def _library(description: Any, version: int, archive: Archive) -> str:
    platform: str = fmpy.platform if version == 2 else fmpy.platform_tuple
    identifier = description.coSimulation.modelIdentifier
    name = f"binaries/{platform}/{identifier}{fmpy.sharedLibraryExtension}"
    names = archive.names()
    if name in names:
        return name
    found = {it.split("/")[1] for it in names if it.startswith("binaries/") and it.count("/") > 1}
    if platform in found:
        raise Refusal(f"it has no library `{name}`")
    has = f"it has {', '.join(sorted(found))}" if found else "it has no binaries"
    raise Refusal(f"it has no binary for {platform}: {has}")


def _variable(variable: Any, units: dict[str, Any]) -> dict[str, Any]:
    declared = variable.declaredType
    unit = variable.unit or (declared.unit if declared is not None else None)
    definition = units.get(unit) if unit else None
    relative = variable.relativeQuantity or (declared is not None and declared.relativeQuantity)
    derivative = variable.derivative
    return {
        "name": variable.name,
        "causality": variable.causality,
        "variability": variable.variability,
        "type": variable.type,
        "size": _size(variable),
        "unit": None if definition is None else _unit(definition, relative=bool(relative)),
        "rate_of": None if derivative is None else derivative.name,
        "has_start": variable.start is not None,
        "min": _bound(variable, "min"),
        "max": _bound(variable, "max"),
    }


def _bound(variable: Any, name: str) -> float | None:
    """Bound of a variable, or of its type."""
    for source in (variable, variable.declaredType):
        bound = _number(getattr(source, name, None))
        if bound is not None and math.isfinite(bound):
            return bound
    return None


def _unit(definition: Any, *, relative: bool) -> dict[str, Any]:
    name, base = definition.name, definition.baseUnit
    if base is None:
        return {"name": name, "exponents": None, "factor": 1.0, "offset": 0.0}
    return {
        "name": name,
        "exponents": [int(getattr(base, it)) for it in _BASES],
        "factor": float(base.factor),
        "offset": 0.0 if relative else float(base.offset),
    }


def _size(variable: Any) -> int:
    size = 1
    for extent in variable.shape or ():
        if not 0 < int(extent) <= _ELEMENTS_MAX:
            raise Refusal(f"`{variable.name}` has a dimension of {extent} elements")
        size *= int(extent)
    return size


def _number(value: object) -> float | None:
    try:
        return None if value is None else float(str(value))
    except ValueError:
        return None
