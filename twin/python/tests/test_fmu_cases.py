"""FMUs made by others: compared with closed forms and with FMPy's own simulation."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
import twinrig
from conftest import ROOT
from fmus import SOURCES

FMUS = ROOT / "target" / "fmus"

pytestmark = pytest.mark.skipif(
    not FMUS.exists() and "CI" not in os.environ, reason="ci/setup has not fetched the FMUs"
)

STEP_S = 2e-3


def simulated(folder: Path, fmu: Path, more: str = "") -> twinrig.Run:
    path = folder / "case.toml"
    path.write_text(f'duration = "1 s"\n[plant]\nmodel = "fmu"\nfile = "{fmu}"\n{more}')
    return twinrig.run(path)


def simulated_by_fmpy(fmu: Path, output: list[str], **options: Any) -> Any:
    return fmpy.simulate_fmu(
        str(fmu),
        stop_time=1.0,
        output_interval=STEP_S,
        step_size=STEP_S,
        output=output,
        fmi_type="CoSimulation",
        **options,
    )


def test_ball_of_the_reference_fmus(folder: Path) -> None:
    fmu = FMUS / "reference-ball.fmu"
    h = simulated(folder, fmu).signals["h"]
    assert h.unit == "m"
    expected = simulated_by_fmpy(fmu, ["h", "v"])
    np.testing.assert_allclose(h.time, expected["time"], atol=1e-12)
    np.testing.assert_allclose(h, expected["h"], atol=1e-9)
    falling = h.time < 0.44
    # Its solver has steps of 1 ms, of first order.
    free = 1.0 - 9.81 / 2.0 * h.time**2
    assert 0.0 < np.abs(np.asarray(h) - free)[falling].max() < 9.81 * 1e-3 * 0.44


TABLES = """
[plant.outputs]
"ball/height" = { variable = "h", unit = "m" }
"ball/velocity" = { variable = "v", unit = "m/s" }
[plant.parameters]
e = 0.5
"""


def test_ball_of_the_sdk_by_its_local_variables(folder: Path) -> None:
    fmu = FMUS / "sdk-ball.fmu"
    signals = simulated(folder, fmu, TABLES).signals
    height, velocity = signals["ball/height"], signals["ball/velocity"]
    assert (height.unit, velocity.unit) == ("m", "m/s")
    expected = simulated_by_fmpy(fmu, ["h", "v"], start_values={"e": 0.5})
    np.testing.assert_allclose(height, expected["h"], atol=1e-9)
    np.testing.assert_allclose(velocity, expected["v"], atol=1e-9)


def test_fmu_of_pythonfmu(folder: Path) -> None:
    words = ["build", "-f", str(SOURCES / "oscillator.py"), "-d", str(folder)]
    subprocess.run(
        [sys.executable, "-m", "pythonfmu", *words], check=True, capture_output=True, cwd=folder
    )
    signals = simulated(folder, folder / "Oscillator.fmu").signals
    x = signals["x"]
    np.testing.assert_allclose(x, np.cos(x.time), atol=1e-12)
    np.testing.assert_allclose(signals["v"], -np.sin(x.time), atol=1e-12)


SPRING = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Spring(Fmi2Slave):
    def __init__(self, **options):
        super().__init__(**options)
        self.x = VALUE
        self.register_variable(Real("x", causality=Fmi2Causality.output))

    def exit_initialization_mode(self):
        self.fail("exit", True)

    def do_step(self, current_time, step_size):
        self.fail("step", current_time > 0.1)
        return True

    def fail(self, at, now):
        if at == "WHERE" and now:
            raise ValueError("the spring is broken")
"""


def spring(folder: Path, value: float = 0.0, where: str = "") -> Path:
    """FMU with a constant output, that may raise an exception."""
    source = SPRING.replace("VALUE", str(value)).replace("WHERE", where)
    (folder / "spring.py").write_text(source)
    words = [sys.executable, "-m", "pythonfmu", "build", "-f", "spring.py"]
    subprocess.run(words, check=True, capture_output=True, cwd=folder)
    return folder / "Spring.fmu"


@pytest.mark.parametrize("where", ["exit", "step"])
def test_exception_of_pythonfmu_is_in_the_error(folder: Path, where: str) -> None:
    with pytest.raises(twinrig.TwinError, match="the spring is broken"):
        simulated(folder, spring(folder, where=where))


def test_fmus_in_this_process_have_modules_of_their_own(folder: Path) -> None:
    paths = [*sys.path]
    for value in (1.0, 2.0):
        run = simulated(folder, spring(folder, value=value), "isolated = false\n")
        np.testing.assert_array_equal(run.signals["x"], value)
    assert sys.path == paths


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("fmi1", "FMI 1.0 is not supported; FMI 2.0 and 3.0 are"),
        ("model-exchange", "it has no co-simulation interface: model exchange only"),
        ("needs-packages", "`fmi2Instantiate` returned no instance"),
    ],
)
def test_fmus_that_cannot_be_simulated(folder: Path, name: str, reason: str) -> None:
    with pytest.raises(twinrig.ScenarioError) as raised:
        simulated(folder, FMUS / f"{name}.fmu")
    assert reason in str(raised.value)


def test_example_of_the_documentation(folder: Path) -> None:
    page = (ROOT / "docs" / "fmu.md").read_text()
    page = page[page.index("## An FMU as the plant") :]
    for name, language in (("ball.py", "python"), ("ball.toml", "toml")):
        block = re.search(rf"^```{language}\n(.*?)^```", page, re.M | re.S)
        assert block is not None
        (folder / name).write_text(block[1])
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "ball.py"]
    subprocess.run(build, check=True, capture_output=True, cwd=folder)
    run = twinrig.run(folder / "ball.toml")
    assert run.verdict == "pass"
    height = run.signals["ball/height"]
    bounce = math.sqrt(2.0 / 9.81)
    falling, rising = height.time < bounce, (height.time > bounce) & (height.time < 2.0 * bounce)
    free = 1.0 - 9.81 / 2.0 * height.time**2
    since = height.time - bounce
    thrown = 0.8 * 9.81 * bounce * since - 9.81 / 2.0 * since**2
    np.testing.assert_allclose(np.asarray(height)[falling], free[falling], atol=1e-12)
    np.testing.assert_allclose(np.asarray(height)[rising], thrown[rising], atol=1e-12)
