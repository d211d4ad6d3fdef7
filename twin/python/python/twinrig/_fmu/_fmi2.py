"""Instances of FMI 2.0."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import byref, c_double
from itertools import count
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary

from fmpy import calloc, free, fmi2
from fmpy.fmi1 import FMICallException
from fmpy.logging import addLoggerProxy

from twinrig._fmu._errors import Fault, Refusal, Termination
from twinrig._fmu._instance import DISCARD, Instance, fault, loaded
from twinrig._fmu._log import Log
from twinrig._fmu._model import Model

_numbers = count(1)
_logs: WeakValueDictionary[int, Log] = WeakValueDictionary()


def _log(environment: int | None, _: bytes, status: int, __: bytes, message: bytes | None) -> None:
    log = _logs.get(environment or 0)
    if log is not None:
        log.add(status, message)


def _callbacks(log: Log) -> Any:
    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = _LOGGER
    callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(calloc)
    callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(free)
    callbacks.componentEnvironment = number = next(_numbers)
    _logs[number] = log
    # Formats the arguments of a message, which Python cannot. It keeps one logger for all FMUs.
    addLoggerProxy(byref(callbacks))
    return callbacks


_LOGGER = fmi2.fmi2CallbackLoggerTYPE(_log)


class Instance2(Instance):
    """An instance of FMI 2.0."""

    def __init__(self, model: Model, folder: Path, log: Log) -> None:
        fmu = loaded(fmi2.FMU2Slave, model, folder)
        super().__init__(fmu, model, log)
        self._no_return = int(not self.may_go_back())
        try:
            # Many FMUs log the reason of an error only with logging on.
            fmu.instantiate(callbacks=_callbacks(log), loggingOn=True)
        except Exception as error:  # FMPy raises the base class.
            raise Refusal(f"`fmi2Instantiate` returned no instance{log.take()}") from error

    def initialize(self, parameters: Sequence[tuple[Any, bytes]], tolerance: float | None) -> None:
        self.fmu.setupExperiment(tolerance=tolerance, startTime=0.0)
        self.set_parameters(parameters)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def step(self, now: float, duration: float, inputs: bytes) -> None:
        self.inputs.write(inputs)
        try:
            self.fmu.fmi2DoStep(self.fmu.component, now, duration, self._no_return)
        except FMICallException as error:
            if error.status == DISCARD:
                raise self._discarded() from error
            raise fault(error, self.log) from error

    def _discarded(self) -> Fault:
        why, kind_of_end = "it discarded the step", Fault
        last = c_double(float("nan"))
        try:
            if self.fmu.getBooleanStatus(fmi2.fmi2Terminated):
                why, kind_of_end = "the FMU ended the simulation", Termination
            kind = fmi2.fmi2LastSuccessfulTime
            self.fmu.fmi2GetRealStatus(self.fmu.component, kind, byref(last))
            why = f"{why}, which it simulated to {last.value} s"
        except FMICallException:
            pass  # The FMU does not know.
        return kind_of_end("fmi2DoStep", f"{why}{self.log.take()}")
