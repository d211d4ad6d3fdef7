"""Scenarios whose plant is an FMU of a lag of first order."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import twinrig
from fmus import lag
from twinrig import Output

PERIOD_S = 0.5

SCENARIO = """
duration = "1 s"

[controller]
kind = "constant"
period = "10 ms"

[plant]
model = "fmu"
file = "lag.fmu"
"""


class Constant:
    """Commands one metre from the first step on."""

    ports = (Output("u", "m"),)

    def step(self, elapsed: float, inputs: Any, outputs: Any) -> None:
        outputs[0] = 1.0


class Number(Constant):
    """Commands one."""

    ports = (Output("u", "1"),)


def scenario(folder: Path, more: str = "", **options: Any) -> Path:
    """Scenario of the lag, with its FMU."""
    lag(folder / "lag.fmu", **options)
    return written(folder, more)


def written(folder: Path, more: str = "") -> Path:
    path = folder / "lag.toml"
    path.write_text(SCENARIO + more)
    return path


def run(path: Path, controller: type = Constant, **options: Any) -> twinrig.Run:
    return twinrig.run(path, controllers={"constant": controller}, **options)


def program(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "twinrig", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


def lagged(times: Any) -> Any:
    return 1.0 - np.exp(-np.asarray(times) / PERIOD_S)
