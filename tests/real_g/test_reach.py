from __future__ import annotations

from functools import cache

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from real_bench.real_g.reach import PUSH_HEIGHT, STEP, Planes, Reach, Refinement

Array = NDArray[np.float64]

LOW, HIGH = np.full(4, -2.0), np.full(4, 2.0)
GROUND = np.array([[x, y, 1.0] for x in np.linspace(-0.3, 0.3, 7) for y in np.linspace(0, 0.3, 5)])


def hand(posture: Array) -> Array:
    """Where a made-up arm's hand is: two links in a plane that turns, and a joint too many."""
    turn, shoulder, elbow, extra = posture
    reach = 0.6 * np.sin(shoulder) + 0.5 * np.sin(shoulder + elbow + 0.5 * extra)
    drop = 0.6 * np.cos(shoulder) + 0.5 * np.cos(shoulder + elbow + 0.5 * extra)
    return np.array([reach * np.sin(turn), reach * np.cos(turn) - 0.6, 1 - 0.5 * drop])


@cache
def babbled(n: int) -> Reach:
    """The map after n attempts, which is not to be extended."""
    random, reach = np.random.default_rng(0), Reach(LOW, HIGH)
    first = np.array([0.0, 0.6, 0.8, 0.0])
    reach.add(hand(first), first)
    for _ in range(n):
        target = reach.next_target(GROUND, random)
        posture = reach.explore(target, random)
        if reach.is_near(hand(posture), target):
            reach.add(hand(posture), posture)
    return reach


def copied(reach: Reach) -> Reach:
    """A map of its own, that may be extended."""
    copy = Reach(LOW, HIGH)
    copy.set_state(reach.get_state())
    return copy


def refined(reach: Reach, rounds: int, deepest: float = 1.0) -> Refinement:
    """A map refined by trying; the arm is blocked where the hand would be deeper."""
    refinement = Refinement(copied(reach), 11)
    for count in range(rounds * len(refinement)):
        number = count % len(refinement)
        posture = refinement.posture(number)
        point = hand(posture)
        refinement.observe(number, point if point[2] < deepest else None, posture)
    return refinement


def test_more_babbling_reaches_more_and_better() -> None:
    errors = {}
    for n in (30, 600):
        reach = babbled(n)
        targets = GROUND - np.array([0, 0, PUSH_HEIGHT])
        ends = np.array([hand(reach.posture(target)) for target in targets])
        errors[n] = np.linalg.norm(ends - targets, axis=1)
    assert np.median(errors[600]) < 0.02
    assert np.median(errors[600]) < np.median(errors[30]) / 2


@given(seed=st.integers(0, 2**32 - 1))
def test_targets_are_near_what_was_reached_and_postures_in_their_range(seed: int) -> None:
    random, reach = np.random.default_rng(seed), babbled(600)
    target = reach.next_target(GROUND, random)
    assert target is not None
    assert np.linalg.norm(reach.points - target, axis=1).min() < 2.5 * STEP
    posture = reach.explore(target, random)
    assert ((posture >= LOW) & (posture <= HIGH)).all()


def test_first_postures_are_near_the_first() -> None:
    random, reach = np.random.default_rng(0), Reach(LOW, HIGH)
    reach.add(np.zeros(3), np.ones(4))
    assert reach.next_target(GROUND, random) is None
    assert np.abs(reach.explore(None, random) - 1).max() < 0.6


def shares(planes: Planes, share: tuple[float, float]) -> Array:
    return np.asarray(planes.low + np.array(share) * (planes.high - planes.low))


def errors_of(planes: Planes) -> Array:
    """How far the hand is from the places between the nodes, near the ground, (n,)."""
    xy = np.array([shares(planes, (a, b)) for a in (0.35, 0.5, 0.65) for b in (0.35, 0.5, 0.65)])
    ends = np.array([hand(posture) for posture in planes.near(xy)])
    return np.asarray(np.linalg.norm(ends - np.column_stack([xy, [1 - PUSH_HEIGHT] * 9]), axis=1))


def test_tried_postures_are_more_precise() -> None:
    before, after = (errors_of(refined(babbled(30), rounds).planes()) for rounds in (0, 4))
    assert np.median(after) < np.median(before) / 2


def test_blocked_postures_are_raised_until_they_are_free() -> None:
    deepest = 1 - PUSH_HEIGHT - 0.01
    planes = refined(babbled(600), 6, deepest).planes()
    xy = shares(planes, (0.5, 0.5))[None]
    assert 1 - PUSH_HEIGHT - 0.05 < hand(planes.near(xy)[0])[2] < deepest + 0.005


def test_refinement_goes_on_from_its_state() -> None:
    refinement = refined(babbled(30), 1)
    again = Refinement(copied(babbled(30)), 11)
    again.set_state(refinement.get_state())
    middle = shares(refinement.planes(), (0.5, 0.5))[None]
    np.testing.assert_array_equal(again.planes().near(middle), refinement.planes().near(middle))


@cache
def known_planes() -> Planes:
    return refined(babbled(600), 1).planes()


@given(share=st.tuples(st.floats(0, 1), st.floats(0, 1)))
def test_position_is_the_inverse_of_near(share: tuple[float, float]) -> None:
    planes = known_planes()
    xy = shares(planes, share)
    np.testing.assert_allclose(planes.position(planes.near(xy[None])[0]), xy, atol=1e-7)


def test_raised_postures_are_above_near_ones() -> None:
    planes = known_planes()
    middle = shares(planes, (0.5, 0.5))[None]
    near, raised = hand(planes.near(middle)[0]), hand(planes.raised(middle)[0])
    np.testing.assert_allclose(near[:2], raised[:2], atol=0.03)
    assert near[2] > raised[2] + 0.1  # farther from the camera


def test_state_gives_the_same_map() -> None:
    again = Reach(LOW, HIGH)
    again.set_state(babbled(30).get_state())
    target = np.array([0.1, 0.1, 0.9])
    np.testing.assert_array_equal(again.posture(target), babbled(30).posture(target))
