from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from real_bench.scoring import Interval, mean_interval
from real_bench.scoring.statistics import (
    interquartile_mean,
    standard_error,
    stratified_interval,
    stratified_mean_interval,
)

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


REPEATS = st.integers(2, 6).flatmap(
    lambda n: st.lists(st.lists(st.floats(0, 1), min_size=5, max_size=5), min_size=n, max_size=n)
)


def test_the_stratified_interval_is_that_worked_out_by_hand() -> None:
    """Two repeats of two goals: each goal's mean is drawn from four equally likely pairs.

    Goal 1 has 0.0 and 0.2, goal 2 has 0.4 and 0.8. Widened by sqrt(2) about 0.1 and 0.6 their
    resampled means are m - w, m, m, m + w with w = 0.1 sqrt(2) and 0.2 sqrt(2). The mean of both is
    lowest, 0.35 - 0.15 sqrt(2), in one of 16 cases: more than 2.5%, so it is the low end.
    """
    interval = stratified_interval([[0.0, 0.4], [0.2, 0.8]])
    assert interval is not None
    assert interval.low == pytest.approx(0.35 - 0.15 * np.sqrt(2))
    assert interval.high == pytest.approx(0.35 + 0.15 * np.sqrt(2))


@pytest.mark.parametrize("n_repeats", [2, 3, 10])
def test_the_stratified_interval_holds_the_truth_as_often_as_it_says(n_repeats: int) -> None:
    """Scores as ours are: skewed, each goal with a mean of its own; 50 goals."""
    random = np.random.default_rng(n_repeats)
    goals = random.beta(0.5, 2, size=50)
    held = 0
    for number in range(400):
        scores = goals + 0.15 * (random.exponential(size=(n_repeats, 50)) - 1)
        interval = stratified_interval(scores, seed=number, resamples=1000)
        assert interval is not None
        held += interval.low <= goals.mean() <= interval.high
    assert 0.92 <= held / 400 <= 0.98


@settings(max_examples=30, deadline=None)
@given(REPEATS)
def test_the_order_of_repeats_does_not_matter(scores: list[list[float]]) -> None:
    interval = stratified_interval(scores)
    assert interval is not None
    assert stratified_interval(scores[::-1]) == interval
    assert interval.low - ROUNDING <= np.mean(scores) <= interval.high + ROUNDING


def test_one_repeat_has_neither_interval_nor_error() -> None:
    assert stratified_interval([[0.1, 0.2]]) is None
    assert standard_error([[0.1, 0.2]]) is None


def test_the_standard_error_is_that_of_the_means() -> None:
    assert standard_error([[0.0, 0.2], [0.2, 0.4], [0.4, 0.6]]) == pytest.approx(0.2 / np.sqrt(3))


def test_the_interquartile_mean_leaves_out_a_quarter_at_each_end() -> None:
    assert interquartile_mean([[0.0, 1.0, 0.4, 0.2]]) == pytest.approx(0.3)
    assert interquartile_mean([[0.0, 0.4], [1.0, 0.2]]) == pytest.approx(0.3)


def test_goals_are_resampled_within_their_class() -> None:
    """Were classes mixed, the mean of these could be anything between 0 and 1."""
    values, classes = [0.0] * 25 + [1.0] * 25, ["2D"] * 25 + ["3D"] * 25
    assert stratified_mean_interval(values, classes) == Interval(0.5, 0.5)
    assert stratified_mean_interval([0.3], ["2D"]) is None
    mixed = np.random.default_rng(1).uniform(size=50)
    interval, plain = stratified_mean_interval(mixed, ["2D"] * 50), mean_interval(mixed)
    assert interval == plain


def test_a_class_with_one_goal_is_not_taken_to_be_certain() -> None:
    interval = stratified_mean_interval([0.0, 0.2, 0.9], ["2D", "2D", "3D"])
    assert interval == stratified_mean_interval([0.0, 0.2, 0.9], ["2D"] * 3)
    each = stratified_mean_interval([0.0, 0.9], ["2D", "3D"])
    assert each is not None
    assert each.low < each.high
