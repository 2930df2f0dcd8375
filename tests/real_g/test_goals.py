from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from real_bench.real_g.goals import SelfGeneratedGoals

LOW, HIGH = np.array([-1.0, -2.0]), np.array([1.0, 2.0])
CELL = (HIGH - LOW) / 8


@given(seed=st.integers(0, 1000))
def test_they_are_where_objects_have_been_and_a_little_beyond(seed: int) -> None:
    random = np.random.default_rng(seed)
    goals = SelfGeneratedGoals(LOW, HIGH, cells=8, margin=1)
    places = random.uniform(LOW, HIGH, (2, 2))
    goals.observe(places)
    for _ in range(20):
        goal = goals.draw(random)
        assert ((goal >= LOW) & (goal <= HIGH)).all()
        assert (np.abs(goal - places) <= 2 * CELL).all(axis=1).any()


def test_before_anything_was_seen_they_are_anywhere() -> None:
    random, goals = np.random.default_rng(0), SelfGeneratedGoals(LOW, HIGH)
    drawn = np.array([goals.draw(random) for _ in range(400)])
    assert (drawn.min(axis=0) < LOW + CELL).all()
    assert (drawn.max(axis=0) > HIGH - CELL).all()


def test_a_place_where_it_gets_better_is_more_interesting_than_one_where_it_does_not() -> None:
    goals = SelfGeneratedGoals(LOW, HIGH)
    for number in range(20):
        goals.record_attempt(LOW, float(number >= 10))
        goals.record_attempt(HIGH, 1.0)
    assert goals.interest(0, 0) > 2 * goals.interest(7, 7)


def test_what_was_never_tried_is_more_interesting_than_what_never_changes() -> None:
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
