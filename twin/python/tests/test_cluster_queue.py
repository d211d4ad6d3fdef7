"""The simulated queue of a campaign, against closed forms."""

from __future__ import annotations

import importlib.util
import math
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from conftest import ROOT
from hypothesis import given, settings
from hypothesis import strategies as st


def _script() -> Any:
    path = ROOT / "twin/python/benches/cluster_queue.py"
    spec = importlib.util.spec_from_file_location("cluster_queue", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


queue = _script()

EVEN = queue.Campaign(runs=1, machines=1, slots=1, run_s=2.0, spread=0.0, batch_s=0.0)
"""Runs of equal duration, longer than a batch: a batch each."""


@settings(max_examples=50)
@given(runs=st.integers(1, 500), machines=st.integers(1, 7), slots=st.integers(1, 5))
def test_equal_runs_take_whole_rounds(runs: int, machines: int, slots: int) -> None:
    outcome = queue.simulated(replace(EVEN, runs=runs, machines=machines, slots=slots))
    rounds = math.ceil(runs / (machines * slots))
    assert outcome.wall_s == pytest.approx(rounds * 2.0)
    assert (outcome.batches, outcome.repeated) == (runs, 0)


def test_small_runs_lose_little_to_the_end() -> None:
    # The last batches have one run each: no slot waits for longer than a few of them.
    outcome = queue.simulated(replace(EVEN, runs=100_000, machines=10, slots=10, run_s=0.01))
    assert 10.0 <= outcome.wall_s < 10.1
    assert outcome.batches < 5000


def test_overhead_is_of_batches() -> None:
    campaign = replace(EVEN, runs=1000, run_s=0.01, batch_s=0.5)
    outcome = queue.simulated(campaign)
    assert outcome.wall_s == pytest.approx(1000 * 0.01 + 0.5 * outcome.batches)


def test_head_that_is_slow_is_the_bound() -> None:
    campaign = replace(EVEN, runs=1000, machines=100, slots=10, head_row_s=0.01)
    assert queue.simulated(campaign).wall_s == pytest.approx(2.0 + 1000 * 0.01)


def test_failures_cost_what_renewal_theory_says() -> None:
    # Runs of D on one slot that fails at the rate λ and returns after R: an attempt succeeds with
    # probability exp(-λD), and the mean of a run is (exp(λD) - 1)(1/λ + R).
    duration_s, mtbf_s, restart_s, runs = 2.0, 10.0, 3.0, 400
    campaign = replace(EVEN, runs=runs, mtbf_s=mtbf_s, restart_s=restart_s)
    expected_s = (math.exp(duration_s / mtbf_s) - 1) * (mtbf_s + restart_s) * runs
    outcomes = [queue.simulated(replace(campaign, seed=seed)) for seed in range(40)]
    walls_s = np.array([outcome.wall_s for outcome in outcomes])
    error_s = walls_s.std(ddof=1) / math.sqrt(len(walls_s))
    assert abs(walls_s.mean() - expected_s) < 4 * error_s
    # The interval is narrow enough to notice an overhead that is wrong by a quarter.
    assert 16 * error_s < expected_s - runs * duration_s
    assert all(outcome.given_up == 0 for outcome in outcomes)


def test_table_is_a_function_of_its_arguments() -> None:
    campaign = queue.Campaign(runs=2000, machines=3, slots=2)
    tables = {queue.table(campaign, queue.Prices(), queue.Sizes()) for _ in range(2)}
    assert len(tables) == 1
