from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from real_bench.real_g.model_planner import ModelPlanner, PlannerSettings, expected_after
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


def thought(row: Array, random: np.random.Generator, ends: Array) -> Array:
    numbers = drawn(PUSH, len(ends), 3)
    numbers[:, :2] = row[:2] + random.normal(size=(len(ends), 2)) * 0.05
    numbers[:, 2:] = ends
    return np.clip(numbers, PUSH.low, PUSH.high)


@pytest.mark.parametrize("goal", [[-0.1, 0.3, 0], [0.0, -0.3, 0], [-0.2, 0.0, 0]])
def test_chosen_action_takes_the_object_to_the_goal(
    planner: ModelPlanner, goal: list[float]
) -> None:
    row, random = np.array([-0.05, 0.05, 0.0]), np.random.default_rng(0)
    choice = planner.choose(row, np.array(goal), 0, lambda ends: thought(row, random, ends), random)
    assert np.linalg.norm(choice.parameters[:2] - row[:2]) < 0.05
    assert np.linalg.norm(choice.parameters[2:] - goal[:2]) < 0.05
    assert np.linalg.norm(choice.expected_end - goal) < 0.05
    assert choice.gain > 0.5 * choice.distance_now


def test_nothing_is_gained_at_the_goal(planner: ModelPlanner) -> None:
    row, random = np.array([-0.05, 0.05, 0.0]), np.random.default_rng(0)
    choice = planner.choose(row, row.copy(), 3, lambda ends: thought(row, random, ends), random)
    assert choice.distance_now == 0
    assert choice.gain <= 0


@given(
    away=st.lists(st.floats(0, 10), min_size=2, max_size=8),
    n_left=st.integers(1, 9),
    seed=st.integers(0, 100),
)
def test_more_actions_left_never_raise_the_expected_distance(
    away: list[float], n_left: int, seed: int
) -> None:
    outcomes = np.array(away)[None]
    weights = np.random.default_rng(seed).dirichlet(np.ones(len(away)))[None]
    fewer, more = (expected_after(weights, outcomes, n) for n in (n_left, n_left + 1))
    assert more <= fewer + 1e-12
    assert expected_after(weights, outcomes, 1) == pytest.approx(float((weights * outcomes).sum()))
    assert more >= min(away) - 1e-12
    assert expected_after(weights, outcomes, 0) == np.inf
