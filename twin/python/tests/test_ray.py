"""Sweeps and studies on Ray clusters of this machine, of which parts are killed."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import fmus
import pytest
import twinrig
from ray_cluster import ENVIRONMENT, Cluster, cluster
from twinrig import _ray, _ray_address
from twinrig._ray_frames import LOST, RESULT, Frame, JobFrames

pytestmark = pytest.mark.ray

TROT = "scenarios/trot.toml"
POINTS = 160
SPEC = f"""
design = "random"
points = {POINTS}
set = {{ duration = "8 s" }}
dimension = [{{ key = "plant.ground.friction", from = 0.2, to = 0.8 }}]
share = [{{ of = "does not fall", min = "50 %" }}]
"""
FMU = """
duration = "1 s"

[plant]
model = "fmu"
file = "lag.fmu"
"""
LIMIT_S = 60
"""Longest time that a test waits for a program [s]."""


@pytest.fixture(autouse=True)
def _of_the_clusters(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in ENVIRONMENT.items():
        monkeypatch.setenv(name, value)


@pytest.fixture(scope="module")
def spec(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("spec") / "friction.toml"
    path.write_text(SPEC, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def local(spec: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the engine `local`."""
    out = tmp_path_factory.mktemp("local")
    os.chdir(Path(__file__).resolve().parents[3])
    twinrig.sweep(TROT, spec, out=out)
    return out


def results(out: Path) -> list[bytes]:
    return [(out / name).read_bytes() for name in ("rows.csv", "sweep.json", "report.html")]


def stored(out: Path) -> int:
    path = out / "rows" / "all.jsonl"
    return path.read_bytes().count(b"\n") if path.exists() else 0


def start(spec: Path, out: Path, address: str, **variables: str) -> subprocess.Popen[str]:
    """Start a sweep on a cluster."""
    words = [sys.executable, "-m", "twinrig", "sweep", "--engine=ray", f"--address={address}"]
    return subprocess.Popen(
        [*words, f"--out={out}", "--json", TROT, str(spec)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "RAY_gcs_rpc_server_reconnect_timeout_s": "3", **variables},
    )


def after_rows(
    process: subprocess.Popen[str], out: Path, count: int, act: Callable[[], None]
) -> tuple[dict[str, Any], int]:
    """Act when a sweep has stored a number of rows; return its object and its exit code."""
    try:
        end = time.monotonic() + LIMIT_S
        while stored(out) < count and process.poll() is None and time.monotonic() < end:
            time.sleep(0.02)
        assert count <= stored(out) < POINTS
        act()
        text, errors = process.communicate(timeout=LIMIT_S)
    finally:
        process.kill()
    return json.loads(text or errors), process.returncode


@pytest.fixture(scope="module")
def machines() -> Any:
    """A cluster of two machines, of which one is killed by the first test."""
    with cluster(2) as running:
        yield running


def test_killed_machine_changes_nothing(
    machines: Cluster, spec: Path, local: Path, tmp_path: Path
) -> None:
    process = start(spec, tmp_path, machines.address)
    report, code = after_rows(process, tmp_path, 40, lambda: machines.kill("node"))
    assert code in (0, 1) and report["counts"]["missing"] == 0
    assert results(tmp_path) == results(local)


def test_interrupt_ends_the_sweep_soon(machines: Cluster, spec: Path, tmp_path: Path) -> None:
    process = start(spec, tmp_path, machines.address)
    begun = time.monotonic()

    def interrupt() -> None:
        nonlocal begun
        begun = time.monotonic()
        process.send_signal(signal.SIGINT)

    report, code = after_rows(process, tmp_path, 5, interrupt)
    assert (report["verdict"], code) == ("interrupted", 2)
    assert report["counts"]["missing"] == POINTS - stored(tmp_path)
    # Not a timing: without the signal it takes longer than a run of the whole sweep.
    assert time.monotonic() - begun < LIMIT_S / 2


def test_recordings_stay_where_they_are_made(tmp_path: Path) -> None:
    # By a Ray of the sweep's own.
    few = {"dimension": [{"key": "seed", "from": 1, "to": 4}], "set": {"duration": "6 s"}}
    place = tmp_path / "recorded"
    ours = twinrig.sweep(TROT, few, out=tmp_path / "ray", engine="ray", jobs=2, record=place)
    local = twinrig.sweep(TROT, few, out=tmp_path / "local", record=tmp_path / "others")
    assert ours.hash == local.hash
    assert results(ours.folder)[0] == results(local.folder)[0]
    with (ours.folder / "recordings.csv").open(encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    rows = {row["key"]: row for row in ours.rows}
    for line in lines:
        assert line["machine"] == os.uname().nodename and Path(line["path"]).parent == place
        recording = twinrig.read(line["path"])
        assert recording.fingerprint == rows.pop(line["key"])["fingerprint"]
    assert not rows


def driver(address: str, tasks: list[bytes], do: Any, shared: bytes = b"") -> dict[bytes, Any]:
    """Do a job by a driver in this process; return its frames by kind."""
    frames: dict[bytes, Any] = {}

    def emit(written: Sequence[Frame]) -> None:
        for kind, task, contents in written:
            frames.setdefault(kind, {})[task] = contents

    _ray.Driver(JobFrames(address, None, shared, tasks), emit, do).run()
    return frames


def test_task_that_kills_its_worker_takes_no_other_with_it(machines: Cluster) -> None:
    def do(_digest: str, _data: Any, tasks: list[bytes]) -> Any:
        import os

        if b"7" in tasks:
            os.kill(os.getpid(), 9)
        return 0.01, [(True, task + b" done") for task in tasks]

    tasks = [str(number).encode() for number in range(60)]
    frames = driver(machines.address, tasks, do)
    expected = {task: tasks[task] + b" done" for task in range(60) if task != 7}
    assert frames[RESULT] == expected
    assert list(frames[LOST]) == [7] and b"3 workers were lost" in frames[LOST][7]


def test_machine_that_joins_is_used(machines: Cluster) -> None:
    # One is left of the first test.
    def do(_digest: str, _data: Any, tasks: list[bytes]) -> Any:
        import time

        import ray

        time.sleep(0.1)
        node = ray.get_runtime_context().get_node_id().encode()
        return 1.0 * len(tasks), [(True, node) for _ in tasks]

    joining = threading.Thread(target=machines.add_node)
    joining.start()
    frames = driver(machines.address, [b""] * 60, do)
    joining.join()
    assert len(frames[RESULT]) == 60 and len(set(frames[RESULT].values())) == 2


def test_worker_of_another_build_refuses(machines: Cluster) -> None:
    from twinrig import _ray_worker

    with pytest.raises(_ray_address.ClusterError, match="another build of twinrig"):
        driver(machines.address, [b"task"], _ray_worker.do, b"twinjob1" + bytes(32))


def test_fmu_has_a_process_of_its_own_on_a_worker(machines: Cluster, tmp_path: Path) -> None:
    if fmus.COMPILER is None:
        pytest.skip("no C compiler")
    fmus.lag(tmp_path / "lag.fmu")
    scenario = tmp_path / "lag.toml"
    scenario.write_text(FMU, encoding="utf-8")
    few = {"dimension": [{"key": "plant.parameters.gain", "values": [1.0, 2.0]}]}
    ours = twinrig.sweep(
        scenario, few, out=tmp_path / "ray", engine="ray", address=machines.address
    )
    assert ours.verdict == "pass" and len(ours.rows) == 2
    local = twinrig.sweep(scenario, few, out=tmp_path / "local")
    assert results(ours.folder)[0] == results(local.folder)[0]


STEP = {"at": "1 s", "set": "step_length", "to": "8 cm"}
STUDIES: dict[str, tuple[list[str], dict[str, Any]]] = {
    "robustness": (["trot.toml"], {"ensemble": 4}),
    "gait": (["trot.toml"], {"frequency": ["3 Hz", "3.5 Hz"], "step_length": "8 cm"}),
    "radius": (["trot.toml"], {"along": "plant.ground.friction", "to": "0.02", "precision": 0.05}),
    "transition": (["trot.toml"], {"plateau": ["1s", "2s"], "set": {"change": [STEP]}}),
    "modulation": (["step-change.toml"], {"by": "-10mm", "points": 2, "steps": 1, "after": "1s"}),
    "loads": (
        ["tegotae-trot.toml", "tegotae-force.toml"],
        {"by": "-10mm", "points": 1, "steps": 1, "after": "1s", "phases": "1s"},
    ),
}


@pytest.mark.parametrize("kind", STUDIES)
def test_study_on_a_cluster_is_that_of_this_machine(
    kind: str, machines: Cluster, tmp_path: Path
) -> None:
    names, options = STUDIES[kind]
    files = [f"scenarios/{name}" for name in names]
    short = {"duration": "2 s", "expect": [{"body": {"fall": False}}]}
    options = options | {"set": short | options.get("set", {})}

    def study(out: str, **engine: Any) -> Any:
        found = twinrig.command(
            "study", kind, *files, json=True, out=tmp_path / out, **options, **engine
        )
        # The load of the machine, and the folder; radii have neither.
        for name in ("machine", "command"):
            found.pop(name, None)
        return found

    cluster = study("ray", engine="ray", address=machines.address)
    assert cluster == study("local", jobs=1)
    rows = [sorted((tmp_path / out).rglob("all.jsonl")) for out in ("ray", "local")]
    counts = [[path.read_bytes().count(b"\n") for path in paths] for paths in rows]
    assert counts[0] == counts[1] and sum(counts[0]) >= 2


def test_other_token_is_named(machines: Cluster, spec: Path, tmp_path: Path) -> None:
    process = start(spec, tmp_path, machines.address, RAY_AUTH_TOKEN="0" * 64)
    text, errors = process.communicate(timeout=LIMIT_S)
    assert process.returncode == 2
    assert f"the cluster at `{machines.address}` refuses the token" in text + errors


def test_killed_head_ends_the_sweep_which_another_cluster_continues(
    machines: Cluster, spec: Path, local: Path, tmp_path: Path
) -> None:
    process = start(spec, tmp_path, machines.address)
    report, code = after_rows(process, tmp_path, 40, lambda: machines.kill("head"))
    assert code == 2 and "the cluster is lost" in report["error"]
    before = stored(tmp_path)
    assert 40 <= before < POINTS
    with cluster(1) as other:
        process = start(spec, tmp_path, other.address)
        text, _ = process.communicate(timeout=LIMIT_S)
    assert json.loads(text)["counts"]["missing"] == 0
    # No run was repeated.
    assert stored(tmp_path) == POINTS
    assert results(tmp_path) == results(local)
