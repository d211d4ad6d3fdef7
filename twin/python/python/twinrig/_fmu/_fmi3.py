"""Instances of FMI 3.0."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fmpy import fmi3
from fmpy.fmi1 import FMICallException

from twinrig._fmu._errors import Fault, Refusal, Termination
from twinrig._fmu._instance import Instance, fault, loaded
from twinrig._fmu._log import Log
from twinrig._fmu._model import Model

# Limits of one advance: an FMU beyond them does not progress.
_RETURNS_MAX = 10_000
_UPDATES_MAX = 1_000

# Head of a saved state: time of the next event, and the inputs written last with their size.
_HEAD = struct.Struct("<d?I")


class Instance3(Instance):
    """An instance of FMI 3.0."""

    def __init__(self, model: Model, folder: Path, log: Log) -> None:
        fmu = loaded(fmi3.FMU3Slave, model, folder)
        super().__init__(fmu, model, log)
        self._has_events = bool(model.co_simulation.hasEventMode)
        self._next_event: float | None = None
        self._written: bytes | None = None
        self._discrete = False

        def message(_: object, status: int, __: bytes, text: bytes | None) -> None:
            log.add(status, text)

        try:
            # Many FMUs log the reason of an error only with logging on.
            fmu.instantiate(
                loggingOn=True,
                eventModeUsed=self._has_events,
                earlyReturnAllowed=True,
                logMessage=message,
            )
        except Exception as error:  # FMPy raises the base class.
            raise Refusal(
                f"`fmi3InstantiateCoSimulation` returned no instance{log.take()}"
            ) from error

    def connect(self, inputs: Sequence[Any], outputs: Sequence[Any]) -> None:
        super().connect(inputs, outputs)
        self._discrete = any(it.variability != "continuous" for it in inputs)

    def initialize(self, parameters: Sequence[tuple[Any, bytes]], tolerance: float | None) -> None:
        self.set_parameters(parameters)
        self.fmu.enterInitializationMode(tolerance=tolerance, startTime=0.0)
        self.fmu.exitInitializationMode()
        if self._has_events:
            self._leave_event_mode()

    def step(self, now: float, duration: float, inputs: bytes) -> None:
        end = now + duration
        try:
            self._apply(inputs)
            for _ in range(_RETURNS_MAX):
                now = self._substep(now, end)
                if now >= end:
                    return
        except FMICallException as error:
            raise fault(error, self.log) from error
        why = f"it returned early {_RETURNS_MAX} times, at last at {now} s{self.log.take()}"
        raise Fault("fmi3DoStep", why)

    def save(self) -> bytes:
        next_event = math.nan if self._next_event is None else self._next_event
        written = self._written or b""
        head = _HEAD.pack(next_event, self._written is not None, len(written))
        return head + written + super().save()

    def restore(self, saved: bytes) -> None:
        next_event, is_written, size = _HEAD.unpack_from(saved)
        end = _HEAD.size + size
        super().restore(saved[end:])
        self._next_event = None if math.isnan(next_event) else next_event
        self._written = saved[_HEAD.size : end] if is_written else None

    def _apply(self, inputs: bytes) -> None:
        """Write inputs; discrete ones change in event mode only."""
        if not (self._has_events and self._discrete):
            self.inputs.write(inputs)
        elif inputs != self._written:
            self.fmu.enterEventMode()
            self.inputs.write(inputs)
            self._leave_event_mode()
            self._written = inputs

    def _substep(self, now: float, end: float) -> float:
        """Advance to an event, to an early return, or to `end`; return the time reached."""
        target = end
        if self._next_event is not None and now < self._next_event < end:
            target = self._next_event
        event, terminate, early, last = self.fmu.doStep(
            now, target - now, not self.may_go_back()
        )
        if terminate:
            raise Termination("fmi3DoStep", f"the FMU ended the simulation{self.log.take()}")
        reached = target
        if early:
            if not now <= last <= target:
                raise Fault("fmi3DoStep", f"it returned early at {last} s, outside of the step")
            reached = last
        if self._has_events and (event or reached == self._next_event):
            self.fmu.enterEventMode()
            self._leave_event_mode()
        return reached

    def _leave_event_mode(self) -> None:
        for _ in range(_UPDATES_MAX):
            again, terminate, _, _, defined, time = self.fmu.updateDiscreteStates()
            if terminate:
                part = "fmi3UpdateDiscreteStates"
                raise Termination(part, f"the FMU ended the simulation{self.log.take()}")
            self._next_event = time if defined else None
            if not again:
                self.fmu.enterStepMode()
                return
        raise Fault("fmi3UpdateDiscreteStates", f"its events do not end after {_UPDATES_MAX}")
