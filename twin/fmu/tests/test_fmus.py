"""Exported FMUs: judged by the schemas of the standard, and run by masters of others."""

from __future__ import annotations

import ctypes
import json
import random
import re
import threading
import tomllib
import zipfile
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import fmpy
import pytest
import twinrig
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from masters import ROOT, TROT, Cosim, Fmu, Instance, export, twin

ALL_SIGNALS = 'record.signals=["**"]'


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fmus")


@pytest.fixture(scope="session", params=[2, 3], ids=["fmi2", "fmi3"])
def fmi(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture(scope="session")
def rig(folder: Path, fmi: int) -> Iterator[Fmu]:
    fmu = Fmu(export(folder / f"rig{fmi}.fmu", TROT, "rig", fmi))
    yield fmu
    fmu.close()


@pytest.fixture(scope="session")
def plant(folder: Path, fmi: int) -> Iterator[Fmu]:
    fmu = Fmu(export(folder / f"plant{fmi}.fmu", TROT, "plant", fmi, ALL_SIGNALS))
    yield fmu
    fmu.close()


@pytest.mark.parametrize("part", ["plant", "rig"])
@pytest.mark.parametrize("scenario", ["trot", "oncilla-trot", "bench", "passive-legs"])
def test_no_problem_is_found_by_the_schemas(
    folder: Path, fmi: int, scenario: str, part: str
) -> None:
    path = folder / f"{scenario}-{part}{fmi}.fmu"
    export(path, f"scenarios/{scenario}.toml", part, fmi, ALL_SIGNALS)
    assert validate_fmu(str(path)) == []
    path.unlink()


def test_every_function_of_the_standard_is_exported(plant: Fmu) -> None:
    version = 3 if plant.is_fmi3 else 2
    header = (files(fmpy) / "c-code" / f"fmi{version}Functions.h").read_text()
    sections = re.split(r"\*{20,}/?\s+(Common Functions|Functions .*)\s", header)
    names: list[str] = []
    for title, section in zip(sections[1::2], sections[2::2], strict=True):
        # In FMI 2.0 those of model exchange are for FMUs of that kind alone.
        if version == 3 or "Exchange" not in title:
            names += re.findall(rf"FMI{version}_Export (\w+)TYPE", section)
    assert len(names) > 30
    (library,) = Path(plant.folder, "binaries").glob("*/twinrig_fmu.so")
    exported = ctypes.CDLL(str(library))
    assert [name for name in names if not hasattr(exported, name)] == []


def test_fingerprint_is_that_of_the_program(rig: Fmu) -> None:
    report = json.loads(twin("run", TROT, "--no-record", "--json"))
    with rig.instance() as instance:
        for n in range(1, 2001):
            instance.step_to(n * 0.01)
        assert instance.fingerprint() == report["fingerprint"]
        assert instance.fingerprint().startswith("dd43ab1c7de30953")


def test_every_scenario_keeps_its_fingerprint(folder: Path) -> None:
    paths = sorted([*ROOT.glob("scenarios/*.toml"), *ROOT.glob("scenarios/thesis/*.toml")])
    # Those of several minutes take too long here.
    long = {"table-5-4", "trot-damped"}
    scenarios = [str(path.relative_to(ROOT)) for path in paths if path.stem not in long]
    lines = twin("run", *scenarios, "--no-record", "--json").splitlines()
    for scenario, report in zip(scenarios, map(json.loads, lines), strict=True):
        fmu = Fmu(export(folder / "scenario.fmu", scenario, "rig", 2))
        with fmu.instance() as instance:
            duration = float(fmu.description.defaultExperiment.stopTime)
            for n in range(1, 38):
                instance.step_to(duration * n / 37)
            assert instance.fingerprint() == report["fingerprint"], scenario
        fmu.close()


def test_model_description_matches_the_instance(rig: Fmu, plant: Fmu) -> None:
    for fmu in (rig, plant):
        with fmu.instance() as instance:
            for variable in fmu.variables.values():
                if variable.causality != "input":
                    continue
                (value,) = instance.read([variable.name])
                assert value == float(variable.start)
                for bound, beyond in ((variable.min, -1e9), (variable.max, 1e9)):
                    if bound is not None:
                        with pytest.raises(FMICallException):
                            instance.write(variable.name, float(bound) + beyond)
    for fmu in (rig, plant):
        # Inputs that are set in the initialization mode affect no other initial values.
        unknowns = fmu.description.initialUnknowns
        free = {one.variable.name for one in unknowns if one.dependencies is None}
        changed = set()
        names = fmu.outputs()
        for variable in [one for one in fmu.variables.values() if one.causality == "input"]:
            starts = []
            for factor in (1.0, 0.99):
                with fmu.instance(begin={variable.name: factor * float(variable.start)}) as one:
                    starts.append([one.read([name]) for name in names])
            changed |= {name for n, name in enumerate(names) if starts[0][n] != starts[1][n]}
        assert changed <= free
        assert bool(changed) == (fmu is rig)
    frequency = rig.variables["frequency"]
    assert (frequency.unit, float(frequency.start)) == ("Hz", 3.64)
    units = {unit.name: unit.baseUnit for unit in rig.description.unitDefinitions}
    force = units["N"]
    assert (force.kg, force.m, force.s, force.rad) == (1, 1, -2, 0)


def walk(instance: Instance, until: float, step: float) -> list[list[float]]:
    """Step to a time; return the outputs at every step."""
    rows = []
    while instance.now < until - step / 2:
        instance.step_to(round((instance.now + step) / step) * step)
        rows.append(instance.read())
    return rows


@pytest.mark.parametrize("part", ["rig", "plant"])
def test_states_restored_at_random_times_change_no_bit(rig: Fmu, plant: Fmu, part: str) -> None:
    fmu = {"rig": rig, "plant": plant}[part]
    step, until = 0.004, 0.8
    with fmu.instance("straight") as straight:
        expected = walk(straight, until, step)
    draw = random.Random(4)
    rows: list[list[float]] = []
    with fmu.instance("first") as first, fmu.instance("second") as second:
        used, spare = first, second
        while used.now < until - step / 2:
            rows += walk(used, used.now + step * draw.randint(1, 30), step)
            saved, now = used.save(), used.now
            # Astray, and back; or on in the other instance.
            used.step_to(now + 0.0317)
            if draw.random() < 0.5:
                used, spare = spare, used
            used.restore(saved, now)
    assert rows[: len(expected)] == expected


def test_instances_that_take_turns_are_independent(rig: Fmu) -> None:
    def alone(frequency: float) -> list[list[float]]:
        with rig.instance() as instance:
            instance.write("frequency", frequency)
            return walk(instance, 0.3, 0.01)

    expected = [alone(3.0), alone(3.5)]
    assert expected[0] != expected[1]
    with rig.instance("a") as a, rig.instance("b") as b:
        rows: list[list[list[float]]] = [[], []]
        for instance, frequency in ((a, 3.0), (b, 3.5)):
            instance.write("frequency", frequency)
        for n in range(1, 31):
            for instance, row in zip((a, b), rows, strict=True):
                instance.step_to(n * 0.01)
                row.append(instance.read())
    assert rows == expected


def test_instances_on_two_threads_are_independent(rig: Fmu) -> None:
    results: list[str] = []
    folder = Path.cwd()

    def run() -> None:
        with rig.instance() as instance:
            for n in range(1, 101):
                instance.step_to(n * 0.02)
            results.append(instance.fingerprint())

    run()
    threads = [threading.Thread(target=run) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 3
    assert len(set(results)) == 1
    assert Path.cwd() == folder, "loading on two threads changed the folder of the process"


def test_plant_alone_is_the_native_plant(plant: Fmu) -> None:
    """Commands of a recorded run, applied at the instants of that run, give its signals."""
    run = twinrig.run(ROOT / TROT, set={"duration": "2 s", "expect": []}, signals=["**"])
    commands = [one.name for one in plant.variables.values() if one.causality == "input"]
    # Among them means over the observation period.
    outputs = ("body/position", "leg/LF/foot/load", "leg/RH/foot/force", "energy/dissipated")
    signals = {name: run.signals[name] for name in (*commands, *outputs)}
    times = signals[commands[0]].time
    assert len(times) == 1001
    with plant.instance() as instance:
        for n, time in enumerate(times.tolist()):
            instance.step_to(time)
            for name in outputs:
                signal = signals[name]
                assert signal.time[n] == time
                names = [name]
                if not plant.is_fmi3 and signal.ndim == 2:
                    names = [f"{name}[{k}]" for k in range(signal.shape[1])]
                assert instance.read(names) == signal[n].reshape(-1).tolist(), (name, time)
            for name in commands:
                instance.write(name, float(signals[name][n]))


@pytest.mark.parametrize("model", ["massless", "lcp"])
def test_rig_whose_plant_is_an_fmu_is_the_native_rig(folder: Path, fmi: int, model: str) -> None:
    """Exported, imported, and run in the scenario: the same samples, bytes and events."""
    path = folder / f"{model}{fmi}.fmu"
    export(path, TROT, "plant", fmi, f'plant.model="{model}"', ALL_SIGNALS)
    # Accesses at instants that are on no grid.
    common = {
        "duration": "1 s",
        "io.transfer_time": {"min": "0.1 ms", "max": "1.9 ms"},
        "record": {"signals": ["**"]},
        "expect": [],
    }
    native = twinrig.run(ROOT / TROT, plant=model, set=common)
    scenario = tomllib.loads((ROOT / TROT).read_text())
    # The FMU has them.
    del scenario["actuator"]
    scenario["plant"] = {"model": "fmu", "file": str(path)}
    imported = twinrig.run(scenario, set=common)
    assert imported.verdict == "pass"
    assert imported.fingerprint == native.fingerprint


def test_start_time_of_the_master_shifts_the_run(plant: Fmu) -> None:
    def rows(start: float) -> list[list[float]]:
        with plant.instance(start=start) as instance:
            result = []
            for n in range(1, 26):
                instance.step_to(start + n * 0.004)
                result.append(instance.read())
            return result

    assert rows(0.0) == rows(1000.0)


def test_another_master_gets_the_same_bits(folder: Path) -> None:
    """libcosim, at the steps of FMPy, of both parts."""
    for part in ("rig", "plant"):
        fmu = Fmu(export(folder / f"cosim-{part}.fmu", TROT, part, 2))
        with fmu.instance() as instance:
            expected = walk(instance, 0.5, 0.01)
        cosim = Cosim(fmu, 0.01)
        rows = []
        for _ in expected:
            cosim.step()
            rows.append(cosim.read())
        assert rows == expected
        fmu.close()


def test_equal_exports_have_equal_bytes_and_need_no_folder(folder: Path) -> None:
    path = export(folder / "here.fmu", TROT, "rig", 2)
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    scenario = str(ROOT / TROT)
    twin("export", "fmu", scenario, "--part", "rig", cwd=elsewhere)
    assert (elsewhere / "trot.fmu").read_bytes() == path.read_bytes()
    with zipfile.ZipFile(path) as archive:
        assert all(Path(name).parts[0] != ".." for name in archive.namelist())


def test_refused_values_and_steps_raise_and_change_nothing(rig: Fmu) -> None:
    with rig.instance() as instance, rig.instance() as untroubled:
        for each in (instance, untroubled):
            each.step_to(0.1)
        for value in (float("nan"), float("inf"), -1e9):
            with pytest.raises(FMICallException):
                instance.write("duty_factor/fore", value)
        with pytest.raises(FMICallException):
            instance.raw.doStep(0.0, 0.05)
        with pytest.raises(FMICallException):
            instance.raw.deserializeFMUState(instance.save()[:-1])
        for each in (instance, untroubled):
            each.step_to(0.2)
        assert instance.fingerprint() == untroubled.fingerprint()
