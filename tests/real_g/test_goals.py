from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from real_bench.real_g.goals import SelfGeneratedGoals

LOW, HIGH = np.array([-1.0, -2.0]), np.array([1.0, 2.0])
CELL = (HIGH - LOW) / 8


@given(seed=st.integers(0, 1000))
def test_own_goals_are_near_where_objects_have_been(seed: int) -> None:
    random = np.random.default_rng(seed)
    goals = SelfGeneratedGoals(LOW, HIGH, cells=8, margin=1)
    places = random.uniform(LOW, HIGH, (2, 2))
    goals.observe(places)
    for _ in range(20):
        goal = goals.draw(random)
        assert ((goal >= LOW) & (goal <= HIGH)).all()
        assert (np.abs(goal - places) <= 2 * CELL).all(axis=1).any()


def test_own_goals_are_anywhere_before_anything_was_seen() -> None:
    random, goals = np.random.default_rng(0), SelfGeneratedGoals(LOW, HIGH)
    drawn = np.array([goals.draw(random) for _ in range(400)])
    assert (drawn.min(axis=0) < LOW + CELL).all()
    assert (drawn.max(axis=0) > HIGH - CELL).all()


def test_places_with_progress_are_more_interesting_than_those_without() -> None:
    goals = SelfGeneratedGoals(LOW, HIGH)
    for number in range(20):
        goals.record_attempt(LOW, float(number >= 10))
        goals.record_attempt(HIGH, 1.0)
    assert goals.interest(0, 0) > 2 * goals.interest(7, 7)


def test_untried_places_are_more_interesting_than_unchanging_ones() -> None:
    goals = SelfGeneratedGoals(LOW, HIGH)
    for _ in range(20):
        goals.record_attempt(HIGH, 1.0)
    assert goals.interest(0, 0) > goals.interest(7, 7) > 0


@given(st.lists(st.floats(0, 1), max_size=50))
def test_interest_is_positive_and_finite(history: list[float]) -> None:
    goals = SelfGeneratedGoals(LOW, HIGH)
    for success in history:
        goals.record_attempt(LOW, success)
    assert 0 < goals.interest(0, 0) <= 2
