"""Fixtures: the checkout, and a run that several tests look at."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import twinrig

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(autouse=True)
def _in_the_checkout(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


@pytest.fixture(scope="session")
def trot() -> twinrig.Run:
    """A run for tests that only look at it."""
    os.chdir(ROOT)
    return twinrig.run("scenarios/trot.toml")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder for what a test writes."""
    return tmp_path
