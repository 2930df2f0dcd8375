from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from real_bench.real_g.known_actions import KnownActions
from real_bench.real_g.planner import Choice
from real_bench.real_g.relation import Relation
from real_bench.real_g.replay import ReplayPlanner
from tests.real_g.deeds import JOINT_PUSH, PUSH, Array, drawn

World = Callable[[Array, Array], Array]

CONTACT_M = 0.03
"""Between the middle of an object and a hand that pushes it."""


def pushed(before: Array, parameters: Array) -> Array:
    """Where objects end in a world in which a hand pushes ahead what lies in its way."""
    after = before.copy()
    way = parameters[:, 2:] - parameters[:, :2]
    length = np.linalg.norm(way, axis=1)
    ahead = way / length[:, None]
    offset = before[:, :2] - parameters[:, :2]
    along = (offset * ahead).sum(axis=1)
    across = offset[:, 1] * ahead[:, 0] - offset[:, 0] * ahead[:, 1]
    taken = (np.abs(across) < CONTACT_M) & (along > CONTACT_M) & (along < length + CONTACT_M)
    after[taken, :2] += ((length + CONTACT_M - along)[:, None] * ahead)[taken]
    return after


def played(n: int, world: World = pushed, seed: int = 0) -> tuple[Array, Array, Array]:
    """A play of pushes near the object: its rows before and after, and parameters."""
    random = np.random.default_rng(seed)
    before = np.column_stack([random.uniform([-0.2, -0.4], [0.0, 0.4], (n, 2)), np.full(n, 0.1)])
    parameters = drawn(PUSH, n, seed)
    parameters[:, :2] = before[:, :2] + random.normal(size=(n, 2)) * 0.05
    parameters = np.clip(parameters, PUSH.low, PUSH.high)
    return before, world(before, parameters), parameters


def learned(n: int, world: World = pushed, seed: int = 0) -> ReplayPlanner:
    replay = ReplayPlanner(Relation(PUSH))
    replay.learn(*played(n, world, seed))
    return replay


def choose(replay: ReplayPlanner, row: Array, goal: Array, n_left: int = 0) -> Choice:
    return replay.choose(row, goal, n_left, lambda _, ends: ends, np.random.default_rng(0))


@pytest.mark.parametrize("goal", [[-0.1, 0.3, 0.1], [0.0, -0.3, 0.1], [-0.2, 0.0, 0.1]])
def test_chosen_action_takes_the_object_to_the_goal(goal: list[float]) -> None:
    row = np.array([-0.05, 0.05, 0.1])
    choice = choose(learned(5000), row, np.array(goal))
    after = pushed(row[None], choice.parameters[None])[0]
    assert np.linalg.norm(after - goal) < 0.04
    assert choice.distance_now == pytest.approx(np.linalg.norm(row - goal))
    assert choice.gain > 0.5 * choice.distance_now


@pytest.mark.parametrize("seed", range(3))
def test_a_trial_brings_the_object_near_the_goal(seed: int) -> None:
    """With a play of 400 pushes, none of which would bring it there at once."""
    replay, goal = learned(400, seed=seed), np.array([-0.1, 0.2, 0.1])
    row = np.array([-0.12, -0.1, 0.1])
    for n_left in reversed(range(10)):
        choice = choose(replay, row, goal, n_left)
        if choice.gain > 0:
            after = pushed(row[None], choice.parameters[None])[0]
            replay.observe(row, after, choice.parameters)
            row = after
    assert np.linalg.norm(row - goal) < 0.015


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


def test_the_last_action_takes_fewer_risks() -> None:
    """Three pushes in ten lose the object, which counts the more, the fewer actions are left."""

    def risky(before: Array, parameters: Array) -> Array:
        after = pushed(before, parameters)
        after[np.random.default_rng(1).random(len(after)) < 0.3, :2] += 0.3
        return after

    replay, row = learned(3000, risky), np.array([-0.1, 0.0, 0.1])
    goal = np.array([-0.1, 0.25, 0.1])
    expected = [choose(replay, row, goal, n_left).expected_distance for n_left in range(10)]
    assert expected == sorted(expected, reverse=True)
    assert expected[0] > expected[-1]


def test_what_did_nothing_in_a_trial_is_not_tried_for_ever() -> None:
    """In the trial the object is stuck, which the play does not know of."""
    replay, goal = learned(2000), np.array([-0.1, 0.2, 0.1])
    row = np.array([-0.1, 0.0, 0.1])
    chosen = []
    for n_left in reversed(range(10)):
        choice = choose(replay, row, goal, n_left)
        chosen.append(tuple(choice.parameters))
        replay.observe(row, row, choice.parameters)
    assert len(set(chosen)) > 5


def test_a_new_trial_forgets_the_last_one() -> None:
    replay, row, goal = learned(300), np.array([-0.1, 0.0, 0.1]), np.array([-0.1, 0.2, 0.1])
    first = choose(replay, row, goal)
    for _ in range(3):
        replay.observe(row, row, first.parameters)
    assert choose(replay, row, goal).expected_distance != first.expected_distance
    replay.start_trial()
    np.testing.assert_array_equal(choose(replay, row, goal).parameters, first.parameters)


@given(
    x=st.floats(-0.2, 0.0), y=st.floats(-0.4, 0.4), n=st.integers(0, 40), seed=st.integers(0, 99)
)
@settings(deadline=None)
def test_repeated_actions_are_those_of_the_play_where_the_object_is(
    x: float, y: float, n: int, seed: int
) -> None:
    """Each begins and ends relative to the object as one of the play did, and within reach."""
    before, after, parameters = played(n, seed=seed)
    row = np.array([x, y, 0.1])
    found, ends = KnownActions(Relation(PUSH), before, after, parameters).repeated(row)
    assert ends.shape == (len(found), 3)
    assert ((found >= PUSH.low) & (found <= PUSH.high)).all()
    relative = np.column_stack([parameters - np.tile(before[:, :2], 2), after - before])
    repeated = np.column_stack([found - np.tile(row[:2], 2), ends - row])
    for candidate in repeated:
        assert np.abs(relative - candidate).max(axis=1).min() < 1e-9


@given(n=st.integers(1, 40), m=st.integers(1, 5), seed=st.integers(0, 99))
@settings(deadline=None)
def test_weights_of_similar_actions_sum_to_one_and_fall(n: int, m: int, seed: int) -> None:
    known = KnownActions(Relation(PUSH), *played(n, seed=seed))
    ends, weights = known.outcomes(np.array([-0.1, 0.0, 0.1]), drawn(PUSH, m, seed))
    assert ends.shape == (m, min(n, 11), 3)
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    assert (np.diff(weights, axis=1) <= 1e-12).all()


@given(longer=st.floats(-0.01, 0.05), angle=st.floats(0, 6.28))
@settings(deadline=None)
def test_what_is_pushed_ahead_ends_where_it_was_relative_to_the_hand(
    longer: float, angle: float
) -> None:
    """One push is known, by 0.05 m; another one along the same line, longer or shorter."""
    ahead = np.array([np.cos(angle), np.sin(angle)])
    row, end = np.array([-0.1, 0.0, 0.1]), np.array([-0.1, 0.0, 0.15])
    end[:2] += 0.05 * ahead
    known_push = np.concatenate([row[:2] - 0.08 * ahead, row[:2] + 0.02 * ahead])
    known = KnownActions(Relation(PUSH), row[None], end[None], known_push[None])
    push = known_push + longer * np.concatenate([[0, 0], ahead])
    ends, _ = known.outcomes(row, push[None])
    np.testing.assert_allclose(ends[0, 0], end + longer * np.array([*ahead, 0]), atol=1e-9)


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


def test_plays_that_were_kept_without_orientations_are_still_of_use() -> None:
    replay, goal = learned(300), np.array([-0.1, 0.2, 0.1])
    row = np.array([-0.1, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0])
    choice = choose(replay, row, goal)
    np.testing.assert_array_equal(choice.parameters, choose(replay, row[:3], goal).parameters)
    replay.observe(row, row, choice.parameters)
    assert np.isfinite(choose(replay, row, goal).expected_distance)


def test_pushes_that_err_by_place_are_judged_by_those_near_there() -> None:
    """As pushes with joints do, through a map that was learned."""

    def erring(before: Array, parameters: Array) -> Array:
        return pushed(before, parameters + np.tile(0.06 * np.sin(9 * before[:, :2]), 2))

    before, after, parameters = played(4000, erring)
    n = len(before) - 500
    errors = []
    for deed in (PUSH, JOINT_PUSH):
        known = KnownActions(Relation(deed), before[:n], after[:n], parameters[:n])
        for row, end, action in zip(before[n:], after[n:], parameters[n:], strict=True):
            ends, weights = known.outcomes(row, action[None])
            errors.append(np.linalg.norm(weights[0] @ ends[0] - end))
    exact, by_place = np.reshape(errors, (2, 500)).mean(axis=1)
    assert by_place < 0.9 * exact
