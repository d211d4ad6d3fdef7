"""Plants exported as FMUs, in the place of the plants that they were exported from."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import twinrig
from conftest import ROOT

CASES = [
    ("trot", {"duration": "2 s"}, 2),
    ("trot", {"duration": "2 s"}, 3),
    ("trot", {"duration": "200 ms", "plant.model": "lcp"}, 2),
    # With a bus: boards sample and actuate between control steps.
    ("oncilla-trot", {"duration": "500 ms"}, 3),
    # With tactile sensors, which a bus mounts on the plant and which are not in the FMU.
    ("trot-foot-load", {"duration": "500 ms"}, 2),
]


def exported(folder: Path, scenario: str, settings: dict[str, str], version: int) -> Path:
    """FMU of the plant of a scenario."""
    fmu = folder / "plant.fmu"
    words = [f"--set={key}={value}" for key, value in settings.items()]
    done = subprocess.run(
        [sys.executable, "-m", "twinrig", "export", "fmu", scenario, *words]
        + ["--fmi", str(version), "--out", str(fmu)],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0 and "twinrig-fmu" in done.stderr and "CI" not in os.environ:
        pytest.skip("the library of FMUs is not built")
    assert done.returncode == 0, done.stderr
    return fmu


@pytest.mark.parametrize(("name", "settings", "version"), CASES)
def test_fmu_in_the_place_of_its_plant_changes_no_bit(
    folder: Path, name: str, settings: dict[str, str], version: int
) -> None:
    scenario = str(ROOT / "scenarios" / f"{name}.toml")
    fmu = exported(folder, scenario, {**settings, "expect": "[]"}, version)
    options: dict[str, Any] = {**settings, "expect": []}
    native = twinrig.run(scenario, set=options)
    in_its_place = {**options, "plant.model": "fmu", "plant.file": str(fmu)}
    run = twinrig.run(scenario, set=in_its_place, record=folder)
    assert run.fingerprint == native.fingerprint
    assert run.energy == native.energy
    fmu.unlink()
    (recording,) = folder.glob("*.mcap")
    words = [sys.executable, "-m", "twinrig", "replay", str(recording)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and native.fingerprint in done.stdout


def test_state_of_an_exported_plant_is_restored_in_another_process(folder: Path) -> None:
    scenario = str(ROOT / "scenarios" / "trot.toml")
    fmu = exported(folder, scenario, {}, 2)
    options = {"plant.model": "fmu", "plant.file": str(fmu)}
    with twinrig.Rig(scenario, set=options) as rig:
        rig.step(until=0.503)
        state = rig.save()
        rig.step(until=1.0)
        expected = rig.read("body/position").tobytes()
    with twinrig.Rig(scenario, set=options) as other:
        other.restore(state)
        other.step(until=1.0)
        assert other.read("body/position").tobytes() == expected
