"""Parts of the engine `ray` that need no Ray: batches, the wheel, missing packages."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import json
import os
import signal as signals
import socket
import subprocess
import sys
import time
import types
import zipfile
from pathlib import Path

import pytest
import twinrig
from hypothesis import given
from hypothesis import strategies as st
from twinrig import _ray, _ray_address
from twinrig._ray_batches import ATTEMPTS, SIZE_MAX, TARGET_S, BatchQueue
from twinrig._ray_frames import JobFrames
from twinrig._ray_wheel import wheel


@given(
    count=st.integers(0, 400),
    slots=st.integers(1, 9),
    fatal=st.sets(st.integers(0, 399), max_size=4),
    losses=st.randoms(use_true_random=False),
    share=st.floats(0.0, 0.4),
    duration_s=st.floats(1e-5, 3.0),
)
def test_every_task_is_done_or_is_fatal(
    count: int, slots: int, fatal: set[int], losses: object, share: float, duration_s: float
) -> None:
    queue, done, given_up = BatchQueue(count), [], []
    flying: list[list[int]] = []
    random = losses.random  # type: ignore[attr-defined]
    while True:
        while len(flying) < 2 * slots and (batch := queue.take(slots)):
            flying.append(batch)
        if not flying:
            break
        batch = flying.pop(int(random() * len(flying)))
        # Machines fail without regard to tasks, though not a task's every time.
        if fatal & set(batch) or (len(batch) > 1 and random() < share):
            given_up += queue.lost(batch)
        else:
            queue.done(batch, duration_s * len(batch))
            done += batch
    assert queue.left() == 0
    assert sorted(given_up) == sorted(fatal & set(range(count)))
    assert sorted(done + given_up) == list(range(count))
    assert queue.repeated >= (ATTEMPTS - 1) * len(given_up)


@given(duration_s=st.floats(1e-4, 100.0), slots=st.integers(1, 500))
def test_batches_last_as_long_as_intended(duration_s: float, slots: int) -> None:
    queue = BatchQueue(10**7)
    first = queue.take(slots)
    assert len(first) == 1
    queue.done(first, duration_s)
    size = len(queue.take(slots))
    assert size == 1 or size * duration_s <= TARGET_S * (1 + 1e-9)
    assert size == SIZE_MAX or (size + 1) * duration_s >= TARGET_S * (1 - 1e-9)


def test_last_tasks_are_spread_over_the_slots() -> None:
    queue = BatchQueue(1000)
    queue.done(queue.take(8), 1e-6)
    sizes = []
    while batch := queue.take(8):
        sizes.append(len(batch))
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] <= 1000 / 16 + 1 and sizes[-16:] == [1] * 16


def test_wheel_has_the_imported_package(tmp_path: Path) -> None:
    archive = zipfile.ZipFile(io.BytesIO(wheel()))
    (record,) = (name for name in archive.namelist() if name.endswith("RECORD"))
    for name, digest, _ in csv.reader(archive.read(record).decode().splitlines()):
        if name != record:
            found = base64.urlsafe_b64encode(hashlib.sha256(archive.read(name)).digest())
            assert digest == f"sha256={found.decode().rstrip('=')}", name
    archive.extractall(tmp_path)
    program = "import twinrig; print(twinrig.__file__, twinrig.__version__)"
    words = [sys.executable, "-c", program]
    environment = {"PYTHONPATH": str(tmp_path)}
    out = subprocess.run(words, env=environment, check=True, capture_output=True, text=True).stdout
    assert out == f"{tmp_path / 'twinrig' / '__init__.py'} {twinrig.__version__}\n"
    ours = Path(str(twinrig._native.__file__))
    assert (tmp_path / "twinrig" / ours.name).read_bytes() == ours.read_bytes()


def test_missing_package_is_an_error_with_its_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "ray.py").write_text("raise ImportError", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    spec = {"dimension": [{"key": "seed", "values": [1]}]}
    with pytest.raises(twinrig.TwinError, match=r'pip install "twinrig\[ray\]"'):
        twinrig.sweep("scenarios/trot.toml", spec, out=tmp_path / "out", engine="ray")


@pytest.mark.parametrize("signal", ["SIGKILL", "SIGTERM"])
def test_package_of_a_worker_is_removed_with_its_process(tmp_path: Path, signal: str) -> None:
    program = """
import os, sys
from twinrig import _ray_worker
folder, _ray_worker.stream = _ray_worker._folder_of_this_process()
open(os.path.join(folder, "a file"), "w").close()
print(folder, flush=True)
sys.stdin.read()
"""
    words = [sys.executable, "-c", program]
    environment = {"PYTHONPATH": os.pathsep.join(sys.path), "TMPDIR": str(tmp_path)}
    with subprocess.Popen(
        words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
    ) as process:
        assert process.stdout is not None
        folder = Path(process.stdout.readline().strip())
        assert (folder / "a file").exists() and folder.parent == tmp_path
        process.send_signal(getattr(signals, signal))
    end = time.monotonic() + 20
    while folder.exists() and time.monotonic() < end:
        time.sleep(0.01)
    assert not folder.exists()


def test_address_is_checked_before_ray_waits_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def error(address: str) -> str:
        with pytest.raises(_ray_address.ClusterError) as raised:
            _ray_address.reachable(_ray_address.requested(address))
        return str(raised.value)

    services = types.ModuleType("services")
    monkeypatch.setitem(sys.modules, "ray._private.services", services)
    with socket.create_server(("127.0.0.1", 0)) as server:
        known = f"127.0.0.1:{server.getsockname()[1]}"
        services.canonicalize_bootstrap_address = {  # type: ignore[attr-defined]
            "auto": known, known: known, "no.host.invalid:6379": "no.host.invalid:6379"
        }.__getitem__
        for address in (known, "auto"):
            asked = _ray_address.requested(address)
            assert _ray_address.reachable(asked) == known
        assert "the host is unknown" in error("no.host.invalid:6379")
    # The server has ended.
    assert error(known) == f"no cluster at `{known}`: Connection refused"
    assert error("auto") == f"no cluster at `auto`, which is {known}: Connection refused"
    for wrong in ("head", "head:", ":6379", "head:port", "head:0", "head:65536", "head:²"):
        assert error(wrong) == f"`{wrong}` is no address of a cluster"


def test_wait_for_a_slot_is_reported_and_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    class NoSlots:
        @staticmethod
        def nodes() -> list[dict[str, object]]:
            return [{"Alive": True, "Resources": {}}]

    waits = []
    driver = _ray.Driver(
        JobFrames(None, None, b"", [b"task"]),
        lambda frames: waits.append(json.loads(frames[0][2])["waits_s"]),
    )
    now = 1000.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    driver._slots_seen = now
    with pytest.raises(_ray_address.ClusterError, match="no slot for 300 s"):
        for _ in range(400):
            driver._report(NoSlots)
            now += 1.0
    assert waits == list(range(300, 0, -1))
