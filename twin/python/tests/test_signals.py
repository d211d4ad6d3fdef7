"""Signals, footsteps and frames of a run are those of its recording, and views without a copy."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import twinrig
from twinrig._signal import Signal


def both(folder: Path, scenario: str, **options: object) -> tuple[twinrig.Run, twinrig.Recording]:
    path = folder / "run.mcap"
    run = twinrig.run(scenario, record=path, **options)  # type: ignore[arg-type]
    assert run.recording == path
    return run, twinrig.read(path)


@pytest.mark.parametrize(
    ("scenario", "options"),
    [
        ("scenarios/trot.toml", {}),
        ("scenarios/oncilla-trot.toml", {}),
        ("scenarios/bench.toml", {}),
        ("scenarios/trot.toml", {"signals": ["leg/LF/hip/*"]}),
        ("scenarios/step-down.toml", {"set": {"record.frames": "400 Hz", "fall.end": True}}),
    ],
)
def test_run_and_recording_have_the_same_numbers(
    folder: Path, scenario: str, options: dict[str, object]
) -> None:
    run, read = both(folder, scenario, **options)
    empty = [name for name in read.signals.groups if not len(read.signals.groups[name])]
    assert list(run.signals.groups) == [name for name in read.signals.groups if name not in empty]
    for name, group in run.signals.groups.items():
        other = read.signals.groups[name]
        assert list(group) == list(other) and group.matrix.size > 0
        assert np.array_equal(group.matrix, other.matrix, equal_nan=True)
        assert np.array_equal(group.time, other.time)
        assert [group[one].unit for one in group] == [other[one].unit for one in other]
    # A `U2` and a `U1` of names compare equal; numbers may be NaN.
    for field in run.footsteps.dtype.names or ():
        kept, written = run.footsteps[field], read.footsteps[field]
        assert np.array_equal(kept, written, equal_nan=field != "leg")
    without_file = [replace(one, file=None) for one in run.expectations]
    assert without_file == read.expectations and run.verdict == read.verdict
    assert (run.fingerprint, run.seed) == (read.fingerprint, read.seed)
    a, b = run.frames(in_parents=True), read.frames(in_parents=True)
    assert list(a) == list(b)
    for name in a:
        assert a[name].parent == b[name].parent
        assert np.array_equal(a[name].time, b[name].time)
        assert np.array_equal(a[name].position, b[name].position)
        assert np.array_equal(a[name].orientation, b[name].orientation)


def test_frames_end_at_the_feet() -> None:
    """The plant computes the positions of the feet by itself."""
    run = twinrig.run("scenarios/trot.toml", set={"record.frames": "500 Hz"})
    frames = run.frames()
    for leg in ("LF", "RF", "LH", "RH"):
        foot = run.signals[f"leg/{leg}/foot/position"]
        frame = frames[f"{leg}_foot"]
        assert frame.relative_to == "world" and frame.position.shape == foot.shape
        assert np.array_equal(frame.time, foot.time)
        assert np.abs(frame.position - foot).max() < 1e-12
    assert np.array_equal(frames["trunk"].orientation, run.signals["body/orientation"])


def test_signals_are_views_of_one_matrix(trot: twinrig.Run) -> None:
    hip = trot.signals["leg/LF/hip/position"]
    group = trot.signals.groups["plant"]
    assert np.shares_memory(hip, group.matrix) and hip.base is not None
    assert hip.shape == (10001,) and hip.dtype == np.float64
    assert trot.signals["body/position"].shape == (10001, 3)
    assert np.shares_memory(trot.signals["body/position"][:, 2], group.matrix)
    assert hip.time.shape == (10001,) and hip.time[0] == 0.0 and hip.time[-1] == 20.0
    assert (hip.unit, hip.name) == ("rad", "leg/LF/hip/position")


def test_selections_keep_their_times_and_results_are_ordinary_arrays(trot: twinrig.Run) -> None:
    body = trot.signals["body/position"]
    for index in (slice(10, 20), slice(None, None, 7), body.time > 1.0, [3, 1], Ellipsis):
        part = body[index]
        assert np.array_equal(part.time, body.time[index]) and part.unit == "m"
    height = body[100:, 2]
    assert np.array_equal(height.time, body.time[100:]) and height.name == "body/position"
    assert np.array_equal(height.copy().time, height.time)
    for plain in (body * 2.0, body.mean(axis=0), np.abs(body), body[5], body @ np.eye(3)):
        assert not hasattr(plain, "time"), type(plain)
    # Views whose samples are not known have no times, rather than wrong ones.
    for view in (body.T, body.reshape(-1), body.ravel()):
        assert not hasattr(view, "time")
    assert isinstance(body[5, 2], float)
    out = np.zeros(len(body))
    np.multiply(body[:, 2], 2.0, out=out)
    assert np.array_equal(out, np.asarray(body)[:, 2] * 2.0)


def test_times_follow_the_samples(trot: twinrig.Run) -> None:
    """A signal whose samples are its times shows which times belong to a selection."""
    time = trot.signals["body/position"].time[:20]
    one = Signal(time, "clock", "s", time)
    two = Signal(np.stack([time, time], axis=1), "clocks", "s", time)
    mask = np.arange(20) % 3 == 0
    parts = (slice(None, None, -1), [5, 3, 3], np.array([7, 2]), mask, list(mask), slice(4, 9))
    for part in parts:
        for selected in (one[part], one[..., part], two[..., part, 1], two[..., part, :]):
            samples = np.asarray(selected)
            assert np.array_equal(samples.reshape(len(samples), -1)[:, 0], selected.time)
    for selected in (two[..., ::-1], two[..., 0], two[..., None, :], two[()], one[..., None]):
        assert np.array_equal(selected.time, time)
    for plain in (one[..., None, :], two[..., 3, :], two[..., np.stack([mask, mask], axis=1)]):
        assert not hasattr(plain, "time")
    for permuted in (np.sort(one[::-1]), np.partition(one[::-1], 3)):
        assert not hasattr(permuted, "time")
    backwards = one[::-1].copy()
    backwards.sort()
    assert np.array_equal(backwards, time) and not hasattr(backwards, "time")


def test_unknown_names_are_answered_with_near_ones(trot: twinrig.Run) -> None:
    with pytest.raises(KeyError, match="did you mean 'leg/LF/hip/position'"):
        trot.signals["leg/LF/hip/postion"]
    with pytest.raises(KeyError, match="a name is a string"):
        trot.signals[3]  # type: ignore[index]
    assert "nonsense" not in trot.signals
    with pytest.raises(twinrig.ScenarioError, match="signals=") as raised:
        twinrig.run("scenarios/trot.toml", signals=["leg/LF/hop/*"])
    assert raised.value.problems[0].file == "signals="


def test_runs_are_pickled(trot: twinrig.Run) -> None:
    again = pickle.loads(pickle.dumps(trot))
    assert str(again) == str(trot) and again.report == trot.report
    assert np.array_equal(again.footsteps, trot.footsteps)
    for name in trot.signals:
        assert np.array_equal(again.signals[name], trot.signals[name])
    signal = pickle.loads(pickle.dumps(trot.signals["body/position"][:5]))
    assert (signal.name, signal.unit, len(signal.time)) == ("body/position", "m", 5)


def test_results_are_shown(trot: twinrig.Run) -> None:
    assert str(trot).startswith("trot  massless plant") and "expectations hold" in str(trot)
    assert trot.fingerprint[:16] in repr(trot) and "&lt;" not in str(trot)
    html = trot._repr_html_()
    assert html.startswith("<pre") and "fingerprint" in html
    held = sum(expectation.holds for expectation in trot.expectations)
    assert f"{held} of {len(trot.expectations)} expectations hold" in repr(trot)
    assert trot.energy is not None
    assert 0.0 < abs(trot.energy.residual_j) < 1e-3 * trot.energy.exchanged_j


def test_footsteps_are_where_the_feet_are(trot: twinrig.Run) -> None:
    assert len(trot.footsteps) > 200 and set(trot.footsteps["leg"]) == {"LF", "RF", "LH", "RH"}
    assert (trot.footsteps["lift_off_s"] > trot.footsteps["touch_down_s"]).all()
    for footstep in trot.footsteps:
        foot = trot.signals[f"leg/{footstep['leg']}/foot/position"]
        sample = np.searchsorted(foot.time, footstep["touch_down_s"])
        # Contacts that are one footstep may begin at that of the largest impulse.
        assert np.abs(foot[sample] - footstep["position_m"]).max() < 0.05


def test_scenarios_without_a_file_have_recordings_of_their_own(folder: Path) -> None:
    def run(friction: float) -> Path | None:
        ground = {"friction": friction}
        tables = {
            "robot": "cheetah-cub",
            "duration": "0.1 s",
            "plant": {"model": "massless", "ground": ground},
        }
        return twinrig.run(tables, record=folder).recording

    one, two, again = run(0.3), run(0.6), run(0.3)
    assert one != two and one == again
    assert one is not None and one.name.startswith("scenario-")


def test_arrays_of_a_run_are_read_only() -> None:
    run = twinrig.run("scenarios/trot.toml", set={"until": "1.2 s"})
    for results in (run, pickle.loads(pickle.dumps(run))):
        group = results.signals.groups["plant"]
        arrays = (group.matrix, group.time, group["body/position"], results.footsteps)
        for array in arrays:
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0.0
    copied = run.signals["body/position"].copy()
    copied[0] = 0.0
    assert run.signals["body/position"][0, 2] > 0.0


def test_tables_of_other_packages_have_a_column_for_each_component() -> None:
    import pandas
    import xarray

    signals = twinrig.run("scenarios/trot.toml", set={"until": "1.2 s"}).signals
    group = signals.groups["plant"]
    columns = signals.columns()
    assert len(columns) == group.matrix.shape[1]
    assert np.array_equal(columns["body/position z"], signals["body/position"][:, 2])
    table = signals.to_pandas()
    assert isinstance(table, pandas.DataFrame) and list(table) == list(columns)
    assert np.array_equal(table.to_numpy(), group.matrix)
    assert np.array_equal(table.index, group.time)
    data = signals.to_xarray()
    assert isinstance(data, xarray.Dataset) and list(data) == list(group)
    assert data["leg/LF/hip/torque"].attrs["units"] == "N·m"
    assert np.array_equal(data["body/position"], signals["body/position"])
    for mistaken in (signals, group):
        with pytest.raises(TypeError, match="`columns`, `to_pandas`"):
            pandas.DataFrame(mistaken)
        assert "body/position" in mistaken._repr_html_()
