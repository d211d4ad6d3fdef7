"""Commands of the program as functions, with scenarios as files and as dictionaries."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
import twinrig
from twinrig import _toml

STAND = {
    "robot": "cheetah-cub",
    "duration": "200 ms",
    "plant": {"model": "massless", "ground": {"friction": 0.6}},
    "controller": {"kind": "stand", "period": "2 ms"},
    "expect": [{"name": "height", "body": {"height": {"min": "10 cm"}}}],
}
SPACE = {
    "name": "height",
    "maximize": "height",
    "particles": 4,
    "iterations": 1,
    "dimension": [{"key": "hip_height", "from": "11.5 cm", "to": "13.5 cm"}],
}
SPEC = {
    "points": 3,
    "design": "random",
    "dimension": [{"key": "plant.ground.friction", "from": 0.4, "to": 0.6}],
}


@pytest.fixture(autouse=True)
def _in_a_folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)


@pytest.fixture
def stand(folder: Path) -> Path:
    """The dictionary as a file."""
    path = folder / "stand.toml"
    path.write_text(_toml.document(STAND), encoding="utf-8")
    return path


def test_sweep_of_a_dictionary_is_that_of_its_file(folder: Path, stand: Path) -> None:
    ours = twinrig.sweep(STAND, SPEC, out=folder / "a")
    assert ours.hash == twinrig.sweep(stand, SPEC, out=folder / "b").hash
    assert ours.counts["points"] == 3
    # The commands in the results find the scenario.
    (file,) = folder.glob("scenario-*.toml")
    assert file.name in ours.rows[0]["command"]


def test_search_of_dictionaries_is_that_of_their_files(folder: Path, stand: Path) -> None:
    ours = twinrig.optimize(STAND, SPACE, out=folder / "a")
    # The height is that of the standing robot: the longest legs are best.
    assert ours["verdict"] == "found"
    of_files = twinrig.optimize(stand, SPACE, out=folder / "b")
    assert of_files["hash"] == ours["hash"]
    # Repeated with the rows that are stored.
    assert twinrig.optimize(STAND, SPACE, out=folder / "a") == ours
    best = twinrig.run(folder / "a" / "best.toml")
    assert best.expectations[0].measured == pytest.approx(ours["best"]["objective"])
    with pytest.raises(twinrig.TwinError, match="another|other"):
        twinrig.optimize(STAND, {**SPACE, "seed": 2}, out=folder / "a")
    with pytest.raises(twinrig.TwinError, match="did you mean `height`"):
        twinrig.optimize(STAND, {**SPACE, "maximize": "hight"}, out=folder / "c")


def test_study_of_a_dictionary(folder: Path) -> None:
    study = twinrig.study(
        "stability", STAND, plants=["massless"], duration="50 ms", budget=1, out=folder
    )
    assert study["rows"]


def test_every_other_command_is_a_function_call(folder: Path) -> None:
    drawn = twinrig.command("draw", "oncilla", out=folder / "drawing.svg")
    assert drawn.startswith("written") and "<svg" in (folder / "drawing.svg").read_text()
    urdf = folder / "oncilla.urdf"
    twinrig.command("export", "urdf", "oncilla", out=urdf)
    imported = twinrig.command("import", "urdf", urdf, name="hound", out=folder / "hound.toml")
    assert "hound" in imported and (folder / "hound.toml").exists()
    assert twinrig.command("thesis", list=True)
    cell = {"type": "B", "layers": 2, "glue": "no", "length": "20 mm", "width": "25 mm"}
    assert twinrig.command("cell", "predict", **cell, json=True)
    run = twinrig.run(STAND, record=folder)
    assert run.recording is not None
    assert twinrig.command("replay", run.recording, json=True)
    text = twinrig.command("run", STAND, no_record=True, set={"duration": "100 ms"})
    assert "0.1 s simulated" in text or "100 ms simulated" in text


def test_exported_signals_are_those_of_the_recording(folder: Path) -> None:
    """NumPy reads each array and each number of the text as its bits."""
    recording = twinrig.run(STAND, record=folder).recording
    assert recording is not None
    twinrig.command("export", "csv", recording, out=folder / "tables")
    twinrig.command("export", "npz", recording, out=folder / "all.npz")
    groups = twinrig.read(recording).signals.groups
    with np.load(folder / "all.npz") as archive:
        arrays = dict(archive)
    count = 0
    for name, group in groups.items():
        assert np.array_equal(arrays.pop(f"{name}/time"), group.time)
        for one in group:
            assert np.array_equal(arrays.pop(f"{name}/{one}"), group[one], equal_nan=True)
            count += 1
        path = folder / f"tables/{recording.stem}-{name}.csv"
        heads, *_ = path.read_text().splitlines()
        if not len(group.time):
            continue
        matrix = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
        assert np.array_equal(matrix[:, 0], group.time)
        assert np.array_equal(matrix[:, 1:], group.matrix, equal_nan=True)
        assert len(heads.split(",")) == matrix.shape[1]
    assert not arrays and count > 20
    assert "body/position.0 [m]" in (folder / f"tables/{recording.stem}-plant.csv").read_text()


def test_package_contains_the_library_of_exported_fmus(folder: Path) -> None:
    text = twinrig.command("export", "fmu", STAND, out=folder / "stand.fmu")
    assert text.startswith(f"written {folder}")
    names = zipfile.ZipFile(folder / "stand.fmu").namelist()
    assert any(name.startswith("binaries/linux64/") for name in names), names


def test_refused_commands_are_exceptions(folder: Path) -> None:
    with pytest.raises(twinrig.TwinError, match="did you mean `oncilla`"):
        twinrig.command("draw", "oncila")
    with pytest.raises(twinrig.TwinError, match="unexpected argument '--colour'"):
        twinrig.command("draw", "oncilla", colour="red")
    with pytest.raises(twinrig.TwinError, match="none.mcap"):
        twinrig.command("replay", folder / "none.mcap", json=True)
    with pytest.raises(TypeError, match="expected a path, not int"):
        twinrig.command("draw", 3)  # type: ignore[arg-type]


def test_twin_at_a_pty_ends_with_its_program(folder: Path) -> None:
    with pytest.raises(twinrig.TwinError, match="bus"):
        twinrig.command("serve", STAND)
