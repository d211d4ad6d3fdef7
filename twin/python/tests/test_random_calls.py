"""Calls with arbitrary arguments end in a result or an exception, never in a crash."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import twinrig
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from test_errors import SMALL

ACCEPTABLE = (twinrig.TwinError, TypeError, ValueError, LookupError, MemoryError, OverflowError)

ANYTHING = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=8),
    st.binary(max_size=4),
    st.sampled_from(
        [object(), [], {}, (), [[]], {"a": None}, np.zeros(3), np.array(["x"]), np.float32("nan")]
    ),
    st.sampled_from([Path("pyproject.toml"), "scenarios", "..", "\0", "\ud800", SMALL]),
    st.lists(st.integers() | st.text(max_size=3), max_size=3),
    st.dictionaries(st.text(max_size=4) | st.integers(), st.integers(), max_size=2),
)
KEYS = st.sampled_from(
    ["robot", "plant", "plant.model", "plant.step", "controller", "controller.kind", "expect"]
    + ["seed", "record.signals", "record.frames", "fall", "bus", "change", "a.b.c", "", "="]
)
"""Keys that a valid value cannot turn into a run of hours: neither times nor periods."""
NAMES = ["set", "plant", "seed", "signals", "strict", "nonsense"]
CALLS: list[Callable[..., Any]] = [twinrig.run, twinrig.check, twinrig.plan]
INDICES = ANYTHING | st.slices(600) | st.integers(-700, 700) | st.just(np.array([True, False]))


@pytest.fixture(scope="module")
def small() -> twinrig.Run:
    return twinrig.run(SMALL)


def attempt(call: Callable[[], Any]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            call()
        except ACCEPTABLE:
            pass


def examples(count: int) -> Callable[[Callable[..., None]], Callable[..., None]]:
    return settings(
        max_examples=count,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        derandomize=bool(os.environ.get("CI")),
        database=None,
    )


@examples(4000)
@given(st.sampled_from(CALLS), st.dictionaries(st.sampled_from(NAMES), ANYTHING, max_size=2))
def test_any_arguments(call: Callable[..., Any], options: dict[str, Any]) -> None:
    attempt(lambda: call(SMALL, **options))


@examples(2000)
@given(st.sampled_from(CALLS), st.dictionaries(KEYS, ANYTHING, max_size=2))
def test_any_settings(call: Callable[..., Any], values: dict[str, Any]) -> None:
    # A step of a nanosecond is valid, and takes long: runs get no numbers for it.
    if call is twinrig.run:
        values = {key: value for key, value in values.items() if key != "plant.step"}
    attempt(lambda: call(SMALL, set=values))


@examples(1000)
@given(st.dictionaries(KEYS, ANYTHING, max_size=3))
def test_any_scenario(tables: dict[str, Any]) -> None:
    attempt(lambda: twinrig.check({**SMALL, **tables}))


@examples(1000)
@given(
    st.sampled_from([twinrig.check, twinrig.read, twinrig.diff, twinrig.parts, twinrig.study]),
    ANYTHING,
    ANYTHING,
)
def test_any_path(call: Callable[..., Any], first: Any, second: Any) -> None:
    # Studies of a kind that exists take long.
    arguments = (first, second) if call is twinrig.diff else (first,)
    attempt(lambda: call(*arguments))


@examples(2500)
@given(INDICES, st.sampled_from(["leg/LF/hip/position", "body/position", "nonsense"]))
def test_any_index(small: twinrig.Run, index: Any, name: str) -> None:
    attempt(lambda: small.signals[index])

    def select() -> None:
        found = small.signals[name][index]
        if hasattr(found, "time"):
            assert len(found.time) == len(found)

    attempt(select)
