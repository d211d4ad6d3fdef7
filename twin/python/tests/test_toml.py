"""TOML is written so that Python's own reader reads the same values."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from twinrig import _toml

if sys.version_info < (3, 11):
    pytest.skip("Python 3.11 reads TOML", allow_module_level=True)
import tomllib

TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
SCALARS = (
    TEXT | st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_subnormal=True)
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXT, inner, max_size=3),
    max_leaves=8,
)


def same(a: Any, b: Any) -> bool:
    if isinstance(a, float) and isinstance(b, float):
        return (math.isnan(a) and math.isnan(b)) or (a, math.copysign(1, a)) == (
            b,
            math.copysign(1, b),
        )
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(same, a, b))
    return type(a) is type(b) and bool(a == b)


@settings(max_examples=300, deadline=None)
@given(st.dictionaries(TEXT, VALUES, max_size=4))
def test_documents_read_back(tables: dict[str, Any]) -> None:
    assert same(tomllib.loads(_toml.document(tables)), tables)


@settings(max_examples=300, deadline=None)
@given(VALUES)
def test_values_have_one_line_and_read_back(value: Any) -> None:
    line = _toml.inline(value, "value")
    assert "\n" not in line
    assert same(tomllib.loads(f"value = {line}")["value"], value)


def test_numbers_of_numpy_are_numbers() -> None:
    values = [np.float64(0.1), np.int32(3), np.bool_(True), np.array([1.0, 2.0])]
    assert _toml.inline(values, "value") == "[0.1, 3, true, [1.0, 2.0]]"
