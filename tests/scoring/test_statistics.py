from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from real_bench.scoring import Interval, mean_interval

SCORES = st.lists(st.floats(0, 3), min_size=2, max_size=60)
ROUNDING = 1e-12


@settings(max_examples=40, deadline=None)
@given(SCORES)
def test_an_interval_holds_the_mean_and_stays_among_the_values(values: list[float]) -> None:
    interval = mean_interval(values)
    assert interval is not None
    assert min(values) - ROUNDING <= interval.low <= np.mean(values) + ROUNDING
    assert np.mean(values) - ROUNDING <= interval.high <= max(values) + ROUNDING
    assert mean_interval(values) == interval


@pytest.mark.parametrize("values", [[], [0.3]])
def test_one_value_has_no_interval(values: list[float]) -> None:
    assert mean_interval(values) is None


def test_equal_values_have_an_interval_without_width() -> None:
    assert mean_interval([0.2] * 10) == Interval(0.2, 0.2)


def test_an_interval_is_as_wide_as_theory_says() -> None:
    values = np.random.default_rng(1).normal(5, 2, size=400)
    interval = mean_interval(values)
    assert interval is not None
    half = 1.96 * values.std() / 20
    assert interval.low == pytest.approx(values.mean() - half, abs=0.1 * half)
    assert interval.high == pytest.approx(values.mean() + half, abs=0.1 * half)


def test_the_seed_is_part_of_the_result() -> None:
    values = np.random.default_rng(1).uniform(size=20)
    assert mean_interval(values, seed=1) != mean_interval(values, seed=2)
    assert mean_interval(values) == mean_interval(values, seed=0)
