"""Exported FMUs, and instances of them in FMPy and in libcosim."""

from __future__ import annotations

import os
import shutil
import subprocess
import threading
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

ROOT = Path(__file__).resolve().parents[3]
TROT = "scenarios/trot.toml"

# FMPy changes the current folder of the process while it loads a library. Two threads that load at
# once would leave the process in an unpacked FMU.
LOADING = threading.Lock()


def program() -> str:
    """Return the program, beside which the library of FMUs is."""
    found = os.environ.get("TWIN") or shutil.which("twin")
    assert found, "there is no program `twin`: install the wheel, or name the program by TWIN"
    return found


def twin(*arguments: str | Path, cwd: Path = ROOT) -> str:
    """Run a command of the program, and return its output."""
    words = [program(), *map(str, arguments)]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=cwd)
    assert done.returncode in (0, 1), done.stderr
    return done.stdout


def export(out: Path, scenario: str, part: str, fmi: int, *settings: str) -> Path:
    """Export a part of a scenario."""
    pairs = [word for setting in settings for word in ("--set", setting)]
    arguments = ["export", "fmu", scenario, "--part", part, "--fmi", str(fmi), *pairs]
    twin(*arguments, "--out", out)
    return out


class Fmu:
    """An FMU, unpacked once for all its instances."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.description = read_model_description(path)
        self.folder = extract(path)
        self.is_fmi3 = self.description.fmiVersion != "2.0"
        self.variables = {one.name: one for one in self.description.modelVariables}
        self.references = {name: one.valueReference for name, one in self.variables.items()}

    def outputs(self) -> list[str]:
        """Return the names of the outputs that are numbers."""
        variables = self.variables.values()
        return [one.name for one in variables if one.causality == "output" and one.type != "String"]

    def instance(
        self,
        name: str = "instance",
        *,
        start: float = 0.0,
        begin: Mapping[str, float] | None = None,
    ) -> Instance:
        """Return an instance that can be stepped, with inputs that are set at its start."""
        return Instance(self, name, start, begin or {})

    def close(self) -> None:
        """Delete the unpacked files."""
        shutil.rmtree(self.folder)


class Instance:
    """An instance by either version of FMI, whose outputs are flat lists of numbers."""

    def __init__(
        self, fmu: Fmu, name: str, start: float, begin: Mapping[str, float]
    ) -> None:
        self.fmu = fmu
        kind = FMU3Slave if fmu.is_fmi3 else FMU2Slave
        with LOADING:
            self.raw: Any = kind(
                guid=fmu.description.guid,
                unzipDirectory=fmu.folder,
                modelIdentifier=fmu.description.coSimulation.modelIdentifier,
                instanceName=name,
            )
        self.raw.instantiate()
        self.now = start
        if fmu.is_fmi3:
            self.raw.enterInitializationMode(startTime=start)
        else:
            self.raw.setupExperiment(startTime=start)
            self.raw.enterInitializationMode()
        for variable, value in begin.items():
            self.write(variable, value)
        self.raw.exitInitializationMode()

    def __enter__(self) -> Instance:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.raw.terminate()
        self.raw.freeInstance()

    def read(self, names: list[str] | None = None) -> list[float]:
        """Return the elements of signals, by default of all outputs."""
        names = self.fmu.outputs() if names is None else names
        references = [self.fmu.references[name] for name in names]
        if not self.fmu.is_fmi3:
            return list(self.raw.getReal(references))
        sizes = [max(1, *self.fmu.variables[name].shape or [1]) for name in names]
        return list(self.raw.getFloat64(references, nValues=sum(sizes)))

    def write(self, name: str, value: float) -> None:
        """Set an input."""
        set_input = self.raw.setFloat64 if self.fmu.is_fmi3 else self.raw.setReal
        set_input([self.fmu.references[name]], [value])

    def fingerprint(self) -> str:
        """Return the fingerprint of a rig."""
        (text,) = self.raw.getString([self.fmu.references["fingerprint"]])
        return str(text.decode() if isinstance(text, bytes) else text)

    def step_to(self, to: float) -> None:
        """Advance to a time."""
        self.raw.doStep(self.now, to - self.now)
        self.now = to

    def save(self) -> bytes:
        """Return the state as bytes."""
        state = self.raw.getFMUState()
        saved = self.raw.serializeFMUState(state)
        self.raw.freeFMUState(state)
        return bytes(saved)

    def restore(self, saved: bytes, now: float) -> None:
        """Continue from a state."""
        state = self.raw.deserializeFMUState(saved)
        self.raw.setFMUState(state)
        self.raw.freeFMUState(state)
        self.now = now


class Cosim:
    """An instance by FMI 2.0 in libcosim, which reads all outputs at every step."""

    def __init__(self, fmu: Fmu, step: float) -> None:
        log_output_level(CosimLogLevel.WARNING)
        self.execution = CosimExecution.from_step_size(round(step * 1e9))
        self.index = self.execution.add_local_slave(CosimLocalSlave(str(fmu.path), "instance"))
        self.observer = CosimObserver.create_last_value()
        assert self.execution.add_observer(self.observer)
        self.references = [fmu.references[name] for name in fmu.outputs()]

    def step(self, count: int = 1) -> None:
        """Take steps."""
        assert self.execution.step(count)

    def read(self) -> list[float]:
        """Return the values of all outputs."""
        return list(self.observer.last_real_values(self.index, self.references))
