"""Instances of FMUs: the same calls for FMI 2.0 and 3.0."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fmpy import fmi1
from fmpy.fmi1 import FMICallException

from twinrig._fmu._errors import Fault, Refusal
from twinrig._fmu._log import Log
from twinrig._fmu._model import Model
from twinrig._fmu._values import Values

DISCARD = 2


class Instance(ABC):
    """An instance of an FMU, in the mode in which it is stepped."""

    def __init__(self, fmu: Any, model: Model, log: Log) -> None:
        self.fmu = fmu
        self.model = model
        self.log = log
        self.inputs = self.values(())
        self.outputs = self.values(())

    def values(self, variables: Sequence[Any]) -> Values:
        """Buffer of variables."""
        return Values(self.fmu, self.model.version, variables)

    def connect(self, inputs: Sequence[Any], outputs: Sequence[Any]) -> None:
        """Select the variables that each step transfers."""
        self.inputs, self.outputs = self.values(inputs), self.values(outputs)

    @abstractmethod
    def initialize(self, parameters: Sequence[tuple[Any, bytes]], tolerance: float | None) -> None:
        """Set parameters, and pass through initialization."""

    @abstractmethod
    def step(self, now: float, duration: float, inputs: bytes) -> None:
        """Advance by `duration` from the time `now`, under constant inputs."""

    def save(self) -> bytes:
        """Serialize the state."""
        state = self.fmu.getFMUState()
        try:
            return bytes(self.fmu.serializeFMUState(state))
        finally:
            self.fmu.freeFMUState(state)

    def restore(self, saved: bytes) -> None:
        """Set a serialized state."""
        state = self.fmu.deserializeFMUState(saved)
        try:
            self.fmu.setFMUState(state)
        finally:
            self.fmu.freeFMUState(state)

    def close(self) -> None:
        """End the simulation and unload the library."""
        try:
            self.fmu.terminate()
        except FMICallException:
            pass  # The results are complete.
        self.fmu.freeInstance()

    def set_parameters(self, parameters: Sequence[tuple[Any, bytes]]) -> None:
        """Set the start values of parameters."""
        for variable, value in parameters:
            self.values([variable]).write(value)

    def may_go_back(self) -> bool:
        """Whether a later call may restore an earlier state."""
        return self.model.missing_state is None


def fault(error: FMICallException, log: Log) -> Fault:
    """Translate a status to the failure of a function."""
    labels = ("ok", "warning", "discard", "error", "fatal", "pending")
    status = error.status
    label = labels[status] if 0 <= status < len(labels) else f"the illegal status {status}"
    return Fault(error.function, f"it returned {label}{log.take()}")


class _StayingOs:
    """`os` for FMPy, which would change the current folder of the process to load a library.

    Other threads would meanwhile write into that folder.
    """

    def __getattr__(self, name: str) -> Any:
        return getattr(os, name)

    def chdir(self, folder: object) -> None:
        """Stay."""


fmi1.os = _StayingOs()


def loaded(kind: Any, model: Model, folder: Path) -> Any:
    """Load the library of a model."""
    try:
        return kind(
            guid=model.description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=model.co_simulation.modelIdentifier,
            instanceName=model.co_simulation.modelIdentifier,
        )
    except AttributeError as error:
        symbol = str(error).rsplit(" ", 1)[-1]
        raise Refusal(f"its library `{model.library}` has no function `{symbol}`") from error
    except Exception as error:  # FMPy raises the base class.
        text = str(error).replace(f"{folder}/", "")
        raise Refusal(f"its library cannot be loaded: {text}") from error


