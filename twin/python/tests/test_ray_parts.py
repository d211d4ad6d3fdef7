"""Parts of the engine `ray` that need no Ray: batches, the wheel, missing packages."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import twinrig
from hypothesis import given
from hypothesis import strategies as st
from twinrig._ray_batches import ATTEMPTS, SIZE_MAX, TARGET_S, BatchQueue
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
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    spec = {"dimension": [{"key": "seed", "values": [1]}]}
    with pytest.raises(twinrig.TwinError, match=r'pip install "twinrig\[ray\]"'):
        twinrig.sweep("scenarios/trot.toml", spec, out=tmp_path / "out", engine="ray")
