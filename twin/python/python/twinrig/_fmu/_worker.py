"""A worker: one FMU behind requests and replies that are bytes."""

from __future__ import annotations

import json
import os
import struct
import sys
from enum import IntEnum
from pathlib import Path
from typing import Any

from fmpy.fmi1 import FMICallException

from twinrig._fmu._archive import Archive
from twinrig._fmu._errors import Fault, Refusal, Termination
from twinrig._fmu._instance import Instance, fault
from twinrig._fmu._log import Log
from twinrig._fmu._model import Model, read

_STEP = struct.Struct("<dd")

ARCHIVE = "model.fmu"
EXTRACTED = "fmu"


class Request(IntEnum):
    """Kind of a request."""

    DESCRIBE = 0
    """Reply: description of the model as JSON."""
    START = 1
    """With parameters and names of variables as JSON. Reply: start values of the inputs, outputs
    at time 0."""
    ADVANCE = 2
    """With time, duration and inputs. Reply: outputs."""
    SAVE = 3
    """Reply: the state."""
    RESTORE = 4
    """With a state."""


class Status(IntEnum):
    """Status of a reply."""

    DONE = 0
    REFUSED = 1
    """With the reason."""
    FAILED = 2
    """With part and reason as JSON."""
    TERMINATED = 3
    """The FMU ended the simulation; with part and reason as JSON."""


class Worker:
    """One FMU, from the file `ARCHIVE` in a folder that belongs to the worker."""

    def __init__(self, folder: str, *, echo: bool = False) -> None:
        self._folder = Path(folder)
        self._log = Log(echo=echo)
        self._model: Model | None = None
        self._instance: Instance | None = None

    def call(self, request: int, payload: bytes) -> tuple[int, bytes]:
        """Handle a request; return status and content of the reply."""
        try:
            return Status.DONE, self._handle(request, payload)
        except Refusal as error:
            return Status.REFUSED, str(error).encode()
        except FMICallException as error:
            return _failed(fault(error, self._log))
        except Fault as error:
            return _failed(error)
        except Exception as error:  # Also errors of FMPy end the run, not the program.
            return _failed(Fault(Request(request).name.lower(), f"{type(error).__name__}: {error}"))

    def close(self) -> None:
        """End the simulation and unload the library."""
        instance, self._instance = self._instance, None
        if instance is not None:
            instance.close()
        self._forget_modules()

    def _forget_modules(self) -> None:
        """Forget Python modules of the FMU: the next one may have modules of the same names."""
        folder = f"{self._folder}{os.sep}"
        sys.path[:] = [path for path in sys.path if not str(path).startswith(folder)]
        for name, module in list(sys.modules.items()):
            # Attributes of lazy modules would import them.
            file = getattr(module, "__dict__", {}).get("__file__")
            if str(file).startswith(folder):
                del sys.modules[name]

    def _handle(self, request: int, payload: bytes) -> bytes:
        instance = self._instance
        if instance is None:
            if request == Request.DESCRIBE:
                return json.dumps(self._described().summary()).encode()
            return self._start(json.loads(payload))
        if request == Request.ADVANCE:
            now, duration = _STEP.unpack_from(payload)
            instance.step(now, duration, payload[_STEP.size :])
            return instance.outputs.read()
        if request == Request.SAVE:
            return instance.save()
        instance.restore(payload)
        return b""

    def _described(self) -> Model:
        if self._model is None:
            path = self._folder / ARCHIVE
            archive = Archive(path)
            try:
                self._model = read(path, archive)
            finally:
                archive.close()
        return self._model

    def _start(self, start: dict[str, Any]) -> bytes:
        model = self._described()
        folder = self._folder / EXTRACTED
        archive = Archive(self._folder / ARCHIVE)
        try:
            folder.mkdir()
            archive.extract(folder, model.library)
        finally:
            archive.close()
        instance = self._loaded(model, folder)
        known = {it.name: it for it in model.description.modelVariables}
        instance.connect(
            [known[name] for name in start["inputs"]], [known[name] for name in start["outputs"]]
        )
        parameters = [
            (known[name], struct.pack(f"<{len(values)}d", *values))
            for name, values in start["parameters"]
        ]
        try:
            instance.initialize(parameters, start["tolerance"])
            values = instance.inputs.read() + instance.outputs.read()
        except FMICallException as error:
            failed = fault(error, self._log)
            raise Refusal(f"`{failed.part}` failed: {failed.why}") from error
        except Fault as error:
            raise Refusal(f"`{error.part}`: {error.why}") from error
        self._instance = instance
        return values

    def _loaded(self, model: Model, folder: Path) -> Instance:
        # Imported here: a description needs neither.
        if model.version == 2:
            from twinrig._fmu._fmi2 import Instance2

            return Instance2(model, folder, self._log)
        from twinrig._fmu._fmi3 import Instance3

        return Instance3(model, folder, self._log)


def _failed(error: Fault) -> tuple[int, bytes]:
    status = Status.TERMINATED if isinstance(error, Termination) else Status.FAILED
    return status, json.dumps({"part": error.part, "why": error.why}).encode()
