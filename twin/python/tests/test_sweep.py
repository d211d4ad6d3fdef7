"""Sweeps."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import numpy as np
import pytest
import twinrig

TROT = "scenarios/trot.toml"
SPEC = {
    "name": "friction",
    "design": "random",
    "points": 8,
    "set": {"duration": "6 s"},
    "dimension": [{"key": "plant.ground.friction", "from": 0.2, "to": 0.8}],
    "share": [{"of": "does not fall", "min": "50 %"}],
}


def test_sweep_from_a_dictionary_is_that_of_the_file(tmp_path: Path) -> None:
    spec = tmp_path / "friction.toml"
    spec.write_text(
        """name = "friction"
        design = "random"
        points = 8
        set = { duration = "6 s" }
        dimension = [{ key = "plant.ground.friction", from = 0.2, to = 0.8 }]
        share = [{ of = "does not fall", min = "50 %" }]
        """,
        encoding="utf-8",
    )
    ours = twinrig.sweep(TROT, SPEC, out=tmp_path / "a", jobs=2)
    other = twinrig.sweep(TROT, spec, out=tmp_path / "b", jobs=1)
    assert ours.hash == other.hash
    stood = (ours.columns()["does not fall: verdict"] == "pass").sum()
    assert 0 < stood < 8 and ours.shares[0].held == stood
    written = json.loads((ours.folder / "sweep.json").read_text(encoding="utf-8"))
    assert written["rows"] == ours.rows
    assert pickle.loads(pickle.dumps(ours)).shares == ours.shares


def test_row_is_the_run_with_its_settings(tmp_path: Path) -> None:
    sweep = twinrig.sweep(TROT, SPEC, out=tmp_path)
    columns = sweep.columns()
    friction = float(columns["plant.ground.friction"][3])
    settings = {"record.signals": [], "duration": "6 s", "plant.ground.friction": friction}
    run = twinrig.run(TROT, set=settings)
    assert columns["fingerprint"][3] == run.fingerprint == sweep.rows[3]["fingerprint"]
    speed = next(each for each in run.expectations if each.name == "forward speed")
    assert columns["forward speed: measured [m/s]"][3] == speed.measured


def test_columns_have_numbers_and_texts(tmp_path: Path) -> None:
    columns = twinrig.sweep(TROT, SPEC, out=tmp_path).columns()
    assert all(column.shape == (8,) for column in columns.values())
    assert columns["index"].tolist() == list(range(8))
    assert columns["trots: verdict"].dtype.kind == "U"
    fell = ~np.isnan(columns["fell_at_s"].astype(np.float64))
    assert np.array_equal(fell, columns["does not fall: verdict"] == "fail")


def test_parquet_has_the_columns(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    sweep = twinrig.sweep(TROT, SPEC, out=tmp_path)
    sweep.to_parquet(tmp_path / "rows.parquet")
    table = parquet.read_table(tmp_path / "rows.parquet")
    for name, column in sweep.columns().items():
        assert np.array_equal(table[name].to_numpy(), column) or column.dtype.kind == "f"
    assert table["plant.ground.friction"].to_pylist() == sweep.columns()[
        "plant.ground.friction"
    ].tolist()


def test_changed_program_is_another_build(tmp_path: Path) -> None:
    # The key of a row is of the module, not of the interpreter, which runs any build of it.
    sweep = twinrig.sweep(TROT, SPEC, out=tmp_path)
    interpreter = Path("/proc/self/exe").read_bytes()
    module = Path(str(twinrig._native.__file__)).read_bytes()
    blake3 = pytest.importorskip("blake3").blake3
    assert sweep.report["build"] == blake3(module).hexdigest()
    assert sweep.report["build"] != blake3(interpreter).hexdigest()


def test_missing_runs_have_no_columns(tmp_path: Path) -> None:
    part = twinrig.sweep(TROT, SPEC, out=tmp_path, partition="1/2")
    assert (part.verdict, part.counts["missing"]) == ("partial", 4)
    with pytest.raises(twinrig.TwinError, match="4 runs of the sweep are missing"):
        part.columns()
    assert twinrig.sweep(TROT, SPEC, out=tmp_path).counts["missing"] == 0


def test_mistakes_are_exceptions(tmp_path: Path) -> None:
    with pytest.raises(twinrig.TwinError, match="did you mean `does not fall`"):
        twinrig.sweep(TROT, {**SPEC, "share": [{"of": "does not fal", "min": 0.5}]}, out=tmp_path)
    with pytest.raises(ValueError, match="jobs"):
        twinrig.sweep(TROT, SPEC, jobs=0, out=tmp_path)
    with pytest.raises(ValueError, match="partition"):
        twinrig.sweep(TROT, SPEC, partition="3/2", out=tmp_path)
    with pytest.raises(TypeError, match="spec"):
        twinrig.sweep(TROT, 3, out=tmp_path)  # type: ignore[arg-type]
