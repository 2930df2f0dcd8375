from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from real_bench.scoring import DECAY, distances, goal_score, object_scores
from real_bench.scoring.metric import METRICS, SCORE
from tests.scoring.bench import made

DISTANCES = st.floats(0, 20)  # metres
LENGTHS = st.floats(-5, 5)
POINTS = st.lists(st.tuples(LENGTHS, LENGTHS, LENGTHS), min_size=1, max_size=3)


@pytest.mark.parametrize(
    ("distance", "score"), [(0, 1), (0.05, 0.5), (0.10, 0.25), (0.20, 0.0625), (0.30, 0.015625)]
)
def test_scores_match_a_hand_calculation(distance: float, score: float) -> None:
    assert object_scores([distance])[0] == pytest.approx(score, rel=1e-12)


def test_decay_constant_is_that_of_the_paper() -> None:
    assert pytest.approx(13.862943611198906, rel=1e-15) == DECAY


def test_goal_score_sums_its_objects() -> None:
    goal = np.array([[0, 0, 0.5], [0.1, 0.2, 0.5], [-0.2, 0, 0.4]])
    reached = goal + np.array([[0, 0, 0], [0.06, 0.08, 0], [0, 0, -0.05]])
    np.testing.assert_allclose(distances(reached, goal), [0, 0.10, 0.05], atol=1e-12)
    assert goal_score(reached, goal) == pytest.approx(1 + 0.25 + 0.5)


@given(DISTANCES, DISTANCES)
def test_a_score_falls_with_the_distance(near: float, far: float) -> None:
    near, far = sorted([near, far])
    at_near, at_far = object_scores([near, far])
    assert 0 < at_far <= at_near <= 1
    if far - near > 1e-9:
        assert at_far < at_near


@given(DISTANCES, DISTANCES)
def test_adding_distances_multiplies_scores(one: float, other: float) -> None:
    product = math.prod(object_scores([one, other]).tolist())
    assert object_scores([one + other])[0] == pytest.approx(product, rel=1e-9)


@given(st.data(), POINTS)
def test_score_depends_only_on_offsets_to_the_goal(
    data: st.DataObject, goal: list[tuple[float, float, float]]
) -> None:
    """Shifting both, or swapping them, changes nothing; the order of objects neither."""
    points = st.tuples(LENGTHS, LENGTHS, LENGTHS)
    reached = data.draw(st.lists(points, min_size=len(goal), max_size=len(goal)))
    score = goal_score(reached, goal)
    assert 0 < score <= len(goal)
    shift = np.array(data.draw(points))
    assert goal_score(reached + shift, goal + shift) == pytest.approx(score, rel=1e-9)
    assert goal_score(goal, reached) == score
    assert goal_score(reached[::-1], goal[::-1]) == pytest.approx(score, rel=1e-12)
    assert goal_score(goal, goal) == len(goal)


def test_numbers_of_one_trial_are_no_means() -> None:
    near, far = made([0.02, 0.2]).trials
    success = METRICS["success"]
    assert [success.text_of(trial) for trial in (near, far)] == ["yes", "no"]
    assert METRICS["actions"].text_of(near) == "-"  # it keeps no commands
    assert METRICS[SCORE].text_of(far) == "0.062"
