from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from real_bench.actions import Action, check_action
from real_bench.controls import CONTROLS
from real_bench.errors import RealBenchError
from real_bench.real_g.hand import Primitive, pointing_down
from tests.real_g.deeds import (
    DEEDS,
    HAND,
    JOINT_PUSH,
    JOINTS,
    PUSH,
    drawn,
    numbers_of,
    primitive_of,
)


@given(numbers=numbers_of(HAND))
def test_numbers_of_a_hand_action_can_be_recovered(numbers: Any) -> None:
    action = HAND.action(numbers)
    read = HAND.parameters(action)
    assert read is not None
    np.testing.assert_allclose(HAND.action(read).commands, action.commands, atol=1e-9)
    assert action.duration == HAND.steps == HAND.rest().duration
    check_action(action, CONTROLS["C"]())


@given(numbers=numbers_of(PUSH))
def test_numbers_of_a_push_can_be_recovered(numbers: Any) -> None:
    action = PUSH.action(numbers)
    np.testing.assert_array_equal(PUSH.parameters(action), numbers)
    assert action.duration == PUSH.steps
    check_action(action, CONTROLS["M"]())


@given(numbers=numbers_of(JOINT_PUSH))
def test_numbers_of_a_push_with_joints_can_be_recovered(numbers: Any) -> None:
    action = JOINT_PUSH.action(numbers)
    read = JOINT_PUSH.parameters(action)
    assert read is not None
    np.testing.assert_allclose(read, numbers, atol=1e-7)
    assert action.duration == JOINT_PUSH.steps == JOINT_PUSH.rest().duration
    check_action(action, CONTROLS["J"]())


def test_other_actions_with_joints_are_no_push() -> None:
    commands = JOINT_PUSH.action(drawn(JOINT_PUSH, 1)[0])
    other = commands.commands.copy()
    other[5, 2] += 0.01
    assert JOINT_PUSH.parameters(Action(other, commands.n_steps, commands.line)) is None
    assert JOINT_PUSH.parameters(Action.via_points(np.ones((17, 9)))) is None


@given(numbers=numbers_of(HAND))
def test_hand_commands_stay_in_their_space(numbers: Any) -> None:
    commands = HAND.action(numbers).commands[:-1]
    low, high = HAND.low[[0, 1, 4]], HAND.high[[0, 1, 4]]
    assert (commands[:, :3] >= low - 1e-9).all()
    assert (commands[:, :3] <= high + 1e-9).all()
    np.testing.assert_allclose(np.linalg.norm(commands[:, 3:7], axis=1), 1)


def test_hand_points_straight_down_unless_it_leans() -> None:
    x, y, z, w = pointing_down(0.7, 0.0)
    assert (2 * (x * z + y * w), 1 - 2 * (x * x + y * y)) == pytest.approx((0, -1))
    x, y, z, w = pointing_down(0.7, 0.4)
    way = 2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)
    assert way == pytest.approx((np.sin(0.4), 0, -np.cos(0.4)))


@pytest.mark.parametrize("deed", DEEDS)
def test_cut_actions_and_rests_have_no_numbers(deed: Primitive) -> None:
    action = deed.action(drawn(deed, 1)[0])
    assert deed.parameters(action.first(deed.steps - 1)) is None
    assert deed.parameters(deed.rest()) is None


def test_several_macros_in_one_action_are_no_push() -> None:
    one, other = drawn(PUSH, 2)
    steps = np.array([PUSH.steps - 501, 500, 1])
    action = Action(np.array([one, other, one]), steps, np.zeros(3, bool))
    assert PUSH.parameters(action) is None


@pytest.mark.parametrize("deed", DEEDS)
def test_path_begins_and_ends_where_its_numbers_say(deed: Primitive) -> None:
    numbers = drawn(deed, 1)[0]
    path = deed.path(numbers)
    np.testing.assert_array_equal(path[0, :2], numbers[list(deed.start)])
    np.testing.assert_array_equal(path[-1, :2], numbers[list(deed.end)])


def test_bad_numbers_and_spaces_are_refused() -> None:
    with pytest.raises(RealBenchError, match="16 numbers"):
        HAND.action(np.zeros(14))
    with pytest.raises(RealBenchError, match="real_gj"):
        primitive_of(JOINTS)
