from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from real_bench.real_g.model_planner import (
    ModelPlanner,
    PlannerSettings,
    after_attempts,
    expected_distances,
)
from real_bench.real_g.planner import Propose
from real_bench.real_g.relation import Relation
from tests.real_g.deeds import PUSH, Array, drawn


@pytest.fixture(scope="module")
def planner() -> ModelPlanner:
    """In a world where what a push begins near ends where the push ends; all else stays."""
    random = np.random.default_rng(0)
    relation, numbers = Relation(PUSH), drawn(PUSH, 3000)
    before = np.column_stack([random.uniform([-0.2, -0.4], [0.0, 0.4], (3000, 2)), np.zeros(3000)])
    near = random.random(3000) < 0.5
    numbers[near, :2] = before[near, :2] + random.normal(size=(near.sum(), 2)) * 0.01
    taken = np.linalg.norm(numbers[:, :2] - before[:, :2], axis=1) < 0.05
    after = before.copy()
    after[taken, :2] = numbers[taken, 2:]
    planner = ModelPlanner(relation, 0, 1500, PlannerSettings(samples=400))
    planner.learn(before, after, numbers)
    return planner


def proposals(random: np.random.Generator) -> Propose:
    """Pushes that begin near the object."""

    def propose(row: Array, ends: Array) -> Array:
        numbers = drawn(PUSH, len(ends), 3)
        numbers[:, :2] = row[:2] + random.normal(size=(len(ends), 2)) * 0.05
        numbers[:, 2:] = ends
        return np.clip(numbers, PUSH.low, PUSH.high)

    return propose


@pytest.mark.parametrize("goal", [[-0.1, 0.3, 0], [0.0, -0.3, 0], [-0.2, 0.0, 0]])
def test_chosen_action_takes_the_object_to_the_goal(
    planner: ModelPlanner, goal: list[float]
) -> None:
    row, random = np.array([-0.05, 0.05, 0.0]), np.random.default_rng(0)
    choice = planner.choose(row, np.array(goal), 0, proposals(random), random)
    assert np.linalg.norm(choice.parameters[:2] - row[:2]) < 0.05
    assert np.linalg.norm(choice.parameters[2:] - goal[:2]) < 0.05
    assert np.linalg.norm(choice.expected_end - goal) < 0.05
    assert choice.gain > 0.5 * choice.distance_now


def test_nothing_is_gained_at_the_goal(planner: ModelPlanner) -> None:
    row, random = np.array([-0.05, 0.05, 0.0]), np.random.default_rng(0)
    choice = planner.choose(row, row.copy(), 3, proposals(random), random)
    assert choice.distance_now == 0
    assert choice.gain <= 0


def test_what_failed_is_expected_to_fail_again_in_the_same_trial(planner: ModelPlanner) -> None:
    row, random = np.array([-0.05, 0.05, 0.0]), np.random.default_rng(0)
    goal = np.array([-0.1, 0.3, 0.0])
    first = planner.choose(row, goal, 0, proposals(random), random)
    for _ in range(3):
        planner.observe(row, row, first.parameters)
    weights, distances = planner.distances(row, goal, first.parameters[None])
    assert expected_distances(weights, distances, np.inf)[0] > 0.7 * first.distance_now
    assert planner.choose(row, goal, 0, proposals(random), random).gain < 0.5 * first.gain
    planner.start_trial()
    weights, distances = planner.distances(row, goal, first.parameters[None])
    assert expected_distances(weights, distances, np.inf)[0] < 0.3 * first.distance_now


OUTCOMES = st.integers(0, 10_000).map(
    lambda seed: (
        np.random.default_rng(seed).dirichlet(np.ones(4), (3, 5)),
        np.random.default_rng(seed + 1).uniform(0, 1, (3, 5, 4)),
    )
)


@given(outcomes=OUTCOMES, n=st.integers(1, 9))
def test_more_attempts_never_raise_the_expected_distance(
    outcomes: tuple[Array, Array], n: int
) -> None:
    weights, distances = outcomes
    once = (weights * distances).sum(axis=2).mean(axis=1)
    assert after_attempts(weights, distances, 0).tolist() == [np.inf] * 3
    np.testing.assert_allclose(after_attempts(weights, distances, 1), once)
    fewer, more = (after_attempts(weights, distances, each) for each in (n, n + 1))
    assert (more <= fewer + 1e-12).all()
    assert (more >= distances.min(axis=2).mean(axis=1) - 1e-12).all()


def test_repeating_does_not_help_where_a_member_holds_it_to_fail() -> None:
    """What is chance for each of two members can be repeated until it goes well."""
    distances = np.array([[[0.0, 1.0], [0.0, 1.0]]])
    sure = np.array([[[1.0, 0.0], [0.0, 1.0]]])
    assert after_attempts(sure, distances, 9)[0] == pytest.approx(0.5)
    chance = np.full((1, 2, 2), 0.5)
    assert after_attempts(chance, distances, 9)[0] == pytest.approx(0.5**9)


@given(outcomes=OUTCOMES, floor=st.floats(0, 1))
def test_a_way_back_limits_what_is_lost(outcomes: tuple[Array, Array], floor: float) -> None:
    weights, distances = outcomes
    expected = expected_distances(weights, distances, floor)
    assert (expected <= expected_distances(weights, distances, np.inf) + 1e-12).all()
    assert (expected <= floor + 1e-12).all()
