from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from real_bench.real_g.planner import Choice
from real_bench.real_g.relation import Relation
from real_bench.real_g.replay import N_SIMILAR, ReplayPlanner
from tests.real_g.deeds import PUSH, Array, drawn

World = Callable[[Array, Array], Array]


def followed(before: Array, parameters: Array) -> Array:
    """Where objects end in a world in which what a push begins near ends where it ends."""
    taken = np.linalg.norm(parameters[:, :2] - before[:, :2], axis=1) < 0.05
    after = before.copy()
    after[taken, :2] = parameters[taken, 2:]
    return after


def played(n: int, world: World = followed, seed: int = 0) -> tuple[Array, Array, Array]:
    """A play of pushes near the object: its rows before and after, and parameters."""
    random = np.random.default_rng(seed)
    before = np.column_stack([random.uniform([-0.2, -0.4], [0.0, 0.4], (n, 2)), np.full(n, 0.1)])
    parameters = drawn(PUSH, n, seed)
    parameters[:, :2] = before[:, :2] + random.normal(size=(n, 2)) * 0.03
    parameters = np.clip(parameters, PUSH.low, PUSH.high)
    return before, world(before, parameters), parameters


def learned(n: int, world: World = followed) -> ReplayPlanner:
    replay = ReplayPlanner(Relation(PUSH))
    replay.learn(*played(n, world))
    return replay


def choose(replay: ReplayPlanner, row: Array, goal: Array) -> Choice:
    return replay.choose(row, goal, 0, lambda ends: ends, np.random.default_rng(0))


@pytest.mark.parametrize("goal", [[-0.1, 0.3, 0.1], [0.0, -0.3, 0.1], [-0.2, 0.0, 0.1]])
def test_chosen_action_takes_the_object_to_the_goal(goal: list[float]) -> None:
    row = np.array([-0.05, 0.05, 0.1])
    choice = choose(learned(5000), row, np.array(goal))
    after = followed(row[None], choice.parameters[None])[0]
    assert np.linalg.norm(after - goal) < 0.04
    assert choice.distance_now == pytest.approx(np.linalg.norm(row - goal))
    assert choice.gain > 0.5 * choice.distance_now


def test_an_action_is_judged_by_similar_ones_and_not_by_its_own_luck() -> None:
    """One push in ten does by chance what no similar push does."""
    goal = np.array([-0.1, 0.2, 0.1])

    def lucky(before: Array, parameters: Array) -> Array:
        after = before.copy()
        after[::10] = goal
        return after

    row = np.array([-0.1, 0.0, 0.1])
    choice = choose(learned(2000, lucky), row, goal)
    assert choice.expected_distance > 0.4 * choice.distance_now


@given(
    x=st.floats(-0.2, 0.0), y=st.floats(-0.4, 0.4), n=st.integers(0, 40), seed=st.integers(0, 99)
)
@settings(deadline=None)
def test_candidates_repeat_the_play_where_the_object_is(
    x: float, y: float, n: int, seed: int
) -> None:
    """Each begins and ends relative to the object as one of the play did, and within reach."""
    before, after, parameters = played(n, seed=seed)
    replay = ReplayPlanner(Relation(PUSH))
    replay.learn(before, after, parameters)
    row = np.array([x, y, 0.1])
    found, ends = replay.candidates(row)
    assert ends.shape == (len(found), min(n, N_SIMILAR), 3)
    assert ((found >= PUSH.low) & (found <= PUSH.high)).all()
    relative = parameters - np.tile(before[:, :2], 2)
    for candidate in found - np.tile(row[:2], 2):
        assert np.abs(relative - candidate).max(axis=1).min() < 1e-9


def test_where_nothing_fits_nothing_is_gained() -> None:
    row, goal = np.array([-0.1, 0.0, 0.1]), np.array([-0.1, 0.2, 0.1])
    assert choose(learned(0), row, goal).gain == 0
    assert choose(learned(50), row + 5, goal).gain == 0


def test_what_it_remembers_can_be_kept() -> None:
    replay, restored = learned(300), ReplayPlanner(Relation(PUSH))
    restored.set_state(replay.get_state())
    row, goal = np.array([-0.1, 0.0, 0.1]), np.array([-0.1, 0.2, 0.1])
    np.testing.assert_array_equal(
        choose(replay, row, goal).parameters, choose(restored, row, goal).parameters
    )
