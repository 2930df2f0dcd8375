from __future__ import annotations

import copy
import functools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from real_bench.real_g.hand_sight import HandSight
from tests.real_g.pictures import table

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

GROUND, ARM, HAND, FAR = 10.0, 5.0, 9.0, 1e6
BLUE, GREY = (10, 10, 200), (100, 100, 100)
places = st.tuples(st.integers(60, 250), st.integers(60, 200))


def buffer(distance: Array) -> NDArray[Any]:
    return np.asarray(1 - 1 / distance, np.float32)


def ground() -> Array:
    distance = np.full((240, 320), GROUND)
    distance[:50] = FAR
    return distance


def look(place: tuple[int, int], *, gripper: bool) -> tuple[Image, NDArray[Any]]:
    """An arm to a place (column, row), with its grey gripper there or somewhere else."""
    image, distance = table(), ground()
    column, row = place
    image[:row, column - 10 : column + 10] = BLUE
    distance[:row, column - 10 : column + 10] = ARM
    if gripper:
        image[row : row + 8, column - 3 : column + 3] = GREY
        distance[row : row + 8, column - 3 : column + 3] = HAND
    return image, buffer(distance)


@functools.cache
def lessons() -> HandSight:
    sight = HandSight(buffer(ground()))
    for place in [(80, 90), (160, 120), (240, 150)]:
        image, closed = look(place, gripper=True)
        sight.compare(image, closed, look(place, gripper=False)[1])
    return sight


def taught() -> HandSight:
    return copy.deepcopy(lessons())


@settings(max_examples=30)
@given(place=places)
def test_hand_is_found_where_it_is(place: tuple[int, int]) -> None:
    point = taught().find(*look(place, gripper=True))
    assert point is not None
    x, y = (place[0] - 0.5 - 160) / 160 * 0.9, (place[1] + 3.5 - 120) / 160 * 0.9
    np.testing.assert_allclose(point, [x, y, 0.9], atol=1e-3)


@settings(max_examples=30)
@given(place=places)
def test_arm_and_hidden_hand_are_no_hand(place: tuple[int, int]) -> None:
    assert taught().find(*look(place, gripper=False)) is None


def test_nothing_is_a_hand_before_the_gripper_was_seen_to_move() -> None:
    sight = HandSight(buffer(ground()))
    image, depth = look((160, 120), gripper=True)
    assert sight.find(image, depth) is None
    sight.compare(image, depth, depth)
    assert not sight.colours.any()


@given(n=st.integers(1, 20))
def test_a_swaying_arm_is_no_hand(n: int) -> None:
    sight = taught()
    for _ in range(n):
        sight.compare(*look((160, 120), gripper=True), buffer(ground()))  # all of it is gone
    assert (sight.colours == taught().colours).all()


def test_ground_points_lie_on_the_ground_alone() -> None:
    points = taught().ground_points(4)
    assert points[:, 2] == pytest.approx(1.0, abs=1e-4)
    assert points[:, 1].min() == pytest.approx((52 - 120) / 160, abs=1e-4)


def test_state_finds_the_same() -> None:
    sight = taught()
    again = HandSight.from_state(sight.get_state())
    picture = look((100, 100), gripper=True)
    np.testing.assert_array_equal(again.find(*picture), sight.find(*picture))
