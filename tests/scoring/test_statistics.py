from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy import stats

from real_bench.scoring import Interval, goals_interval, plays_interval
from real_bench.scoring.statistics import (
    interquartile_mean,
    interval_heading,
    mean_interval,
    standard_error,
)

SCORES = st.lists(st.floats(0, 3), min_size=2, max_size=60)
ROUNDING = 1e-12
COUNTS = {"2D": 25, "2.5D": 15, "3D": 10}
CLASSES = [name for name, count in COUNTS.items() for _ in range(count)]


def over_goals(values: Sequence[float], **options: int) -> Interval | None:
    """The interval of goals of one class."""
    return goals_interval(values, ["2D"] * len(values), **options)


@settings(max_examples=40, deadline=None)
@given(SCORES)
def test_interval_contains_the_mean_and_stays_within_the_values(values: list[float]) -> None:
    interval = over_goals(values)
    assert interval is not None
    assert min(values) - ROUNDING <= interval.low <= np.mean(values) + ROUNDING
    assert np.mean(values) - ROUNDING <= interval.high <= max(values) + ROUNDING
    assert over_goals(values) == interval


@pytest.mark.parametrize("values", [[], [0.3]])
def test_fewer_than_two_values_have_no_interval(values: list[float]) -> None:
    assert over_goals(values) is None


def test_unknown_values_have_no_interval() -> None:
    assert over_goals([0.1, np.nan, 0.2]) is None
    assert plays_interval([[0.1, np.nan, 0.2]] * 3, ["2D"] * 3) is None


def test_equal_values_have_an_interval_of_zero_width() -> None:
    assert over_goals([0.2] * 10) == Interval(0.2, 0.2, "goals")
    assert plays_interval([[0.25] * 10] * 3, ["2D"] * 10) == Interval(0.25, 0.25, "plays and goals")


def test_interval_width_matches_theory() -> None:
    values = np.random.default_rng(1).normal(5, 2, size=400)
    interval = over_goals(values.tolist())
    assert interval is not None
    half = 1.96 * values.std() / 20
    assert interval.low == pytest.approx(values.mean() - half, abs=0.1 * half)
    assert interval.high == pytest.approx(values.mean() + half, abs=0.1 * half)


def test_interval_depends_on_the_seed() -> None:
    values = np.random.default_rng(1).uniform(size=20).tolist()
    assert over_goals(values, seed=1) != over_goals(values, seed=2)
    assert over_goals(values) == over_goals(values, seed=0)


PLAYS = st.integers(3, 6).flatmap(
    lambda n: st.lists(st.lists(st.floats(0, 1), min_size=5, max_size=5), min_size=n, max_size=n)
)


def test_interval_over_plays_and_goals_matches_a_hand_calculation() -> None:
    """Three plays of two goals, of one class: means of plays 0.1, 0.3, 0.2, of goals 0.1, 0.3.

    Variance of the plays' means, by three: 0.01 / 3; of the goals' means, by two: 0.02 / 2. What
    is left of each value is +-0.05 in the first play, -+0.05 in the second, 0 in the third: a
    variance of 0.01 / 2, by 2 x 3 values; half of it is taken off.
    """
    values = [[0.05, 0.15], [0.15, 0.45], [0.1, 0.3]]
    interval = plays_interval(values, ["2D", "2D"])
    assert interval is not None
    of_plays, of_goals, of_both = 0.01 / 3, 0.02 / 2, 0.01 / 2 / 6
    whole = of_plays + of_goals
    freedom = whole**2 / (of_plays**2 / 2 + of_goals**2 / 1)
    half = stats.t.ppf(0.975, freedom) * np.sqrt(whole - of_both / 2)
    assert interval.high == pytest.approx(0.2 + half)
    assert interval.low == 0.0  # as no score is below
    lower = plays_interval(np.array(values) - 1, ["2D", "2D"])
    assert lower is not None
    assert lower.low == pytest.approx(-0.8 - half)


@pytest.mark.parametrize("n_plays", [3, 5, 10])
@pytest.mark.parametrize("spread", [0.0, 0.1])
def test_interval_has_its_nominal_coverage(n_plays: int, spread: float) -> None:
    """Scores as ours are: skewed, each goal and each play with a mean of its own."""
    random = np.random.default_rng(n_plays)
    means = np.repeat([0.46, 0.011, 0.007], list(COUNTS.values()))
    held = 0
    for _ in range(1500):
        goals = random.beta(means * 17, (1 - means) * 17)
        plays = np.exp(random.normal(-(spread**2) / 2, spread, (n_plays, 1)))
        share = np.minimum(goals * plays, 0.99)
        interval = plays_interval(random.beta(2 * share, 2 - 2 * share), CLASSES)
        assert interval is not None
        held += interval.low <= means.mean() <= interval.high
    assert 0.92 <= held / 1500 <= 0.98


@settings(max_examples=30, deadline=None)
@example([[0.0] * 5, [0.0] * 5, [0.0] * 4 + [8.8e-122]])  # a variance whose square is 0
@given(PLAYS)
def test_the_order_of_plays_and_goals_does_not_matter(scores: list[list[float]]) -> None:
    classes = ["2D", "3D", "2D", "3D", "2D"]
    interval = plays_interval(scores, classes)
    assert interval is not None
    other = plays_interval(np.array(scores)[::-1, ::-1], classes[::-1])
    assert other is not None
    assert (other.low, other.high) == pytest.approx((interval.low, interval.high))
    assert interval.low - ROUNDING <= np.mean(scores) <= interval.high + ROUNDING


def test_differing_plays_widen_the_interval() -> None:
    random = np.random.default_rng(1)
    alike = random.uniform(0.2, 0.4, (4, 50))
    apart = alike + np.array([[-0.1], [0.1], [0.0], [0.05]])
    one, other = plays_interval(alike, CLASSES), plays_interval(apart, CLASSES)
    assert one is not None
    assert other is not None
    assert other.high - other.low > 3 * (one.high - one.low)


def test_two_plays_are_too_few_for_an_interval_over_plays() -> None:
    values = np.random.default_rng(1).uniform(size=(2, 50))
    assert plays_interval(values, CLASSES) is None
    assert mean_interval(values, CLASSES) == goals_interval(values.mean(axis=0), CLASSES)
    more = np.random.default_rng(1).uniform(size=(3, 50))
    assert mean_interval(more, CLASSES) == plays_interval(more, CLASSES)


def test_an_interval_says_what_it_is_over() -> None:
    interval = mean_interval(np.random.default_rng(1).uniform(size=(3, 50)), CLASSES)
    assert interval is not None
    assert interval_heading(interval.over) == "95% over plays and goals"
    only = mean_interval([[0.1, 0.2]], ["2D"] * 2)
    assert only is not None
    assert interval_heading(only.over) == "95% over goals"


def test_one_repeat_has_neither_interval_nor_error() -> None:
    assert plays_interval([[0.1, 0.2]], ["2D"] * 2, min_plays=1) is None
    assert standard_error([[0.1, 0.2]]) is None


def test_the_standard_error_is_that_of_the_means() -> None:
    assert standard_error([[0.0, 0.2], [0.2, 0.4], [0.4, 0.6]]) == pytest.approx(0.2 / np.sqrt(3))


def test_the_interquartile_mean_leaves_out_a_quarter_at_each_end() -> None:
    assert interquartile_mean([[0.0, 1.0, 0.4, 0.2]]) == pytest.approx(0.3)
    assert interquartile_mean([[0.0, 0.4], [1.0, 0.2]]) == pytest.approx(0.3)


def test_goals_are_resampled_within_their_class() -> None:
    """Were classes mixed, the mean of these could be anything between 0 and 1."""
    values, classes = [0.0] * 25 + [1.0] * 25, ["2D"] * 25 + ["3D"] * 25
    assert goals_interval(values, classes) == Interval(0.5, 0.5, "goals")
    assert goals_interval([0.3], ["2D"]) is None


def test_class_with_one_goal_still_has_uncertainty() -> None:
    interval = goals_interval([0.0, 0.2, 0.9], ["2D", "2D", "3D"])
    assert interval == goals_interval([0.0, 0.2, 0.9], ["2D"] * 3)
    each = goals_interval([0.0, 0.9], ["2D", "3D"])
    assert each is not None
    assert each.low < each.high
