"""Sweeps."""

from __future__ import annotations

import json
import pickle
import signal
from pathlib import Path
from types import FrameType

import numpy as np
import pytest
import twinrig
from conftest import ROOT

TROT = "scenarios/trot.toml"
SPEC = {
    "name": "friction",
    "design": "random",
    "points": 8,
    "set": {"duration": "6 s"},
    "dimension": [{"key": "plant.ground.friction", "from": 0.0, "to": 0.08}],
    "share": [{"of": "does not fall", "min": "50 %"}],
}


def test_sweep_from_a_dictionary_is_that_of_the_file(tmp_path: Path) -> None:
    spec = tmp_path / "friction.toml"
    spec.write_text(
        """name = "friction"
        design = "random"
        points = 8
        set = { duration = "6 s" }
        dimension = [{ key = "plant.ground.friction", from = 0.0, to = 0.08 }]
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
    columns = sweep.columns()
    assert table.column_names == list(columns)
    for name, column in columns.items():
        is_number = column.dtype.kind == "f"
        assert np.array_equal(table[name].to_numpy(), column, equal_nan=is_number), name
    # Both kinds of number are there: a run that stood has no time of a fall.
    fell = np.isnan(columns["fell_at_s"].astype(np.float64))
    assert 0 < fell.sum() < len(fell)


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


def test_run_with_an_error_is_a_row(tmp_path: Path) -> None:
    # The devices of the bus need more than 10 ms to open.
    values = {"key": "until", "values": ["500 ms", "10 ms"]}
    spec = {"name": "short", "design": "grid", "dimension": [values]}
    sweep = twinrig.sweep("scenarios/oncilla-trot.toml", spec, out=tmp_path)
    assert (sweep.verdict, sweep.counts["error"]) == ("error", 1)
    assert sweep.columns()["verdict"].tolist() == [row["verdict"] for row in sweep.rows]
    assert sweep.rows[0]["error"] is None and sweep.rows[1]["error"]


def test_columns_are_those_of_the_sweep_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    trot = ROOT / TROT
    wide = twinrig.sweep(trot, SPEC, out="here")
    expected = wide.columns()
    twinrig.sweep(trot, {**SPEC, "points": 4}, out="here")
    monkeypatch.chdir("/")
    for sweep in (wide, pickle.loads(pickle.dumps(wide))):
        columns = sweep.columns()
        assert list(columns) == list(expected)
        assert columns["key"].tolist() == [row["key"] for row in wide.rows]
        assert (sweep.folder / "rows.csv").exists()


class Alarm(Exception):
    """Raised by a handler of the user."""


def test_interrupted_sweep_continues(tmp_path: Path) -> None:
    def stored(folder: Path) -> bytes:
        return b"".join(file.read_bytes() for file in sorted((folder / "rows").glob("*")))

    # One alarm at a time: a second one would interrupt the handling of the first.
    def handler(number: int, frame: FrameType | None) -> None:
        if stored(tmp_path / "a"):
            raise Alarm
        signal.setitimer(signal.ITIMER_REAL, 0.01)

    spec = {**SPEC, "points": 40, "set": {"duration": "40 s"}}
    before = signal.signal(signal.SIGALRM, handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.01)
        with pytest.raises(Alarm):
            twinrig.sweep(TROT, spec, out=tmp_path / "a")
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    kept = stored(tmp_path / "a")
    assert not (tmp_path / "a" / "rows.csv").exists()
    continued = twinrig.sweep(TROT, spec, out=tmp_path / "a")
    # The rows from before the interrupt are not computed again.
    assert kept and stored(tmp_path / "a").startswith(kept)
    assert continued.hash == twinrig.sweep(TROT, spec, out=tmp_path / "b").hash is not None


def test_mistakes_are_exceptions(tmp_path: Path) -> None:
    with pytest.raises(twinrig.TwinError, match="did you mean `does not fall`"):
        twinrig.sweep(TROT, {**SPEC, "share": [{"of": "does not fal", "min": 0.5}]}, out=tmp_path)
    with pytest.raises(ValueError, match="jobs"):
        twinrig.sweep(TROT, SPEC, jobs=0, out=tmp_path)
    with pytest.raises(ValueError, match="partition"):
        twinrig.sweep(TROT, SPEC, partition="3/2", out=tmp_path)
    with pytest.raises(TypeError, match="spec"):
        twinrig.sweep(TROT, 3, out=tmp_path)  # type: ignore[arg-type]
