"""Actions and the three ways of control."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from real_bench.actions import (
    ACTION_STEPS,
    VIA_POINT_STEPS,
    Action,
    action_segments,
    check_action,
    check_command,
)
from real_bench.controls import CartesianControl, JointControl, MacroControl
from real_bench.controls.macro import plan_macro, push_points
from real_bench.errors import ActionError
from real_bench.simulation import HOME, Scene, Simulation

angles = st.floats(-3, 3)
via_points = st.integers(1, 10).flatmap(lambda n: arrays(np.float64, (n, 9), elements=angles))


def joint_path(action: Action) -> np.ndarray:
    """The joint command of every step; joint control needs no simulation."""
    segments = action_segments(action, JointControl(), None)  # type: ignore[arg-type]
    return np.array([command for command, n_steps in segments for _ in range(n_steps)])


@given(via_points)
def test_via_points_last_a_thousand_steps_and_end_at_home(points: np.ndarray) -> None:
    action = Action.via_points(points)
    path = joint_path(action)
    assert action.duration == len(path) == ACTION_STEPS
    assert (path[VIA_POINT_STEPS:] == 0).all()


@given(via_points)
def test_every_via_point_is_reached_at_its_evenly_spaced_step(points: np.ndarray) -> None:
    path = joint_path(Action.via_points(points))
    for k, point in enumerate(points, start=1):
        assert np.array_equal(path[VIA_POINT_STEPS * k // len(points) - 1], point)


@given(via_points)
def test_between_via_points_the_path_is_straight(points: np.ndarray) -> None:
    path = np.vstack([HOME, joint_path(Action.via_points(points))[:VIA_POINT_STEPS]])
    bends = np.abs(np.diff(path, 2, axis=0)).max(axis=1) > 1e-9
    assert bends.sum() <= len(points) - 1


@given(via_points, st.integers(1, ACTION_STEPS))
def test_shortened_action_keeps_its_first_steps(points: np.ndarray, n_steps: int) -> None:
    action = Action.via_points(points)
    path = joint_path(action.first(n_steps))
    assert len(path) == n_steps
    assert np.allclose(path, joint_path(action)[:n_steps], atol=1e-12)


@given(st.integers(1, 10))
def test_poses_share_a_thousand_steps(n_poses: int) -> None:
    action = Action.poses(np.ones((n_poses, 9)))
    assert action.duration == ACTION_STEPS
    assert np.ptp(action.n_steps) <= 1


@pytest.mark.parametrize(
    "make",
    [
        lambda: Action.via_points(np.zeros((0, 9))),
        lambda: Action.via_points(np.zeros(9)),
        lambda: Action.macro([1, 2, 3]),
        lambda: Action.macro("push"),
        lambda: Action.hold([0.0] * 9, 0),
        lambda: Action.hold([0.0] * 9, 1.5),  # type: ignore[arg-type]
        lambda: Action.hold([0.0] * 9, np.nan),  # type: ignore[arg-type]
        lambda: Action.hold([np.inf] * 9, 10),
        lambda: Action.macro(np.full((2, 2), np.nan)),
        lambda: Action.macro([[1e200, 0], [-1e200, 0]]),
        lambda: Action.via_points(np.full((2, 9), np.nan)),
        lambda: Action.via_points([object()] * 9),  # type: ignore[arg-type]
        lambda: Action(np.zeros((2, 9)), np.array([1]), np.array([False])),
    ],
)
def test_invalid_actions_are_refused(make: Any) -> None:
    with pytest.raises(ActionError):
        make()


@pytest.mark.parametrize(
    ("control", "action", "message"),
    [
        (JointControl(), {}, "'joint_command'"),
        (JointControl(), None, "not NoneType"),
        (JointControl(), [0.0] * 9, "not list"),
        (JointControl(), {"macro_action": [0] * 4}, "it has: macro_action"),
        (JointControl(), {"joint_command": [0] * 8}, r"9 numbers, not an array of shape \(8,\)"),
        (JointControl(), {"joint_command": [np.nan] * 9}, "finite"),
        (JointControl(), {"joint_command": [np.inf] * 9}, "finite"),
        (JointControl(), {"joint_command": ["a"] * 9}, "9 numbers"),
        (JointControl(), {"joint_command": [0] * 9, "extra": 1}, "extra"),
        (MacroControl(), {"macro_action": np.zeros((3, 2))}, "4 numbers"),
        (CartesianControl(), {"cartesian_command": [0] * 7}, "'gripper_command'"),
        (
            CartesianControl(),
            {"cartesian_command": [0.1] * 7, "gripper_command": None},
            "gripper_command is None",
        ),
        (
            CartesianControl(),
            {"cartesian_command": [0] * 7, "gripper_command": [0, 0]},
            "all zeros",
        ),
    ],
)
def test_bad_action_dict_is_refused_with_the_reason(
    control: Any, action: Any, message: str
) -> None:
    with pytest.raises(ActionError, match=message):
        control.command(action)


@pytest.mark.parametrize(
    ("control", "action"),
    [
        (JointControl(), {"joint_command": None}),
        (MacroControl(), {"macro_action": None, "render": [1]}),
        (CartesianControl(), {"cartesian_command": None, "gripper_command": None}),
    ],
)
def test_none_means_no_command_and_goes_home(control: Any, action: Any) -> None:
    command = control.command(action)
    assert command.shape == (control.size,)
    assert np.isnan(command).all()
    assert list(control.segments(command, 7, None)) == [(HOME, 7)]


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (None, "not NoneType"),
        (Action.hold([0.0] * 4, 10), r"shape \(k, 9\)"),
        (Action(np.array([[0.0] * 8 + [np.nan]]), np.array([9]), np.array([False])), "finite"),
    ],
)
def test_bad_whole_action_is_refused_with_the_reason(action: Any, message: str) -> None:
    with pytest.raises(ActionError, match=message):
        check_action(action, JointControl())


def test_only_joints_can_move_on_a_line() -> None:
    with pytest.raises(ActionError, match="straight line"):
        check_action(Action.via_points(np.zeros((2, 9))), CartesianControl())


def test_macro_step_by_step_matches_a_macro_at_once(builtin_scene: Scene) -> None:
    command = np.array([-0.1, 0.2, -0.1, -0.2])
    with Simulation(builtin_scene) as whole, Simulation(builtin_scene) as steps:
        control = MacroControl()
        whole.follow(control.segments(command, 2500, whole))
        control = MacroControl()
        for _ in range(2500):
            steps.follow(control.segments(command, 1, steps))
        assert np.array_equal(whole.object_poses(), steps.object_poses())
        assert np.array_equal(whole.joint_positions(), steps.joint_positions())


def test_macro_lasts_a_thousand_steps_and_ends_at_home(builtin_scene: Scene) -> None:
    with Simulation(builtin_scene) as simulation:
        for points in ((-0.1, 0.2, -0.1, -0.2), (0.0, 0.1, 0.0, 0.1), (-0.25, -0.5, 0.05, 0.5)):
            plan = plan_macro(points, simulation)
            assert sum(n_steps for _, n_steps in plan) == ACTION_STEPS
            assert all(n_steps > 0 for _, n_steps in plan)
            assert plan[-1][0] == HOME


@given(via_points)
def test_commanded_postures_match_the_executed_path(points: np.ndarray) -> None:
    action = Action.via_points(points)
    moments = np.arange(1, ACTION_STEPS + 1)
    np.testing.assert_allclose(action.commanded(moments), joint_path(action), atol=1e-12)


def test_commanded_macro_is_the_macro_throughout() -> None:
    macro = Action.macro([[0.0, 0.1], [-0.2, 0.3]])
    assert macro.commanded([0, 500, 1000]).tolist() == [[0.0, 0.1, -0.2, 0.3]] * 3


def test_macros_end_exactly_at_their_second_point() -> None:
    random = np.random.default_rng(0)
    for points in random.uniform([-0.25, -0.5] * 2, [0.05, 0.5] * 2, (2000, 4)).tolist():
        assert push_points(tuple(points))[-1] == tuple(points[2:])


def test_a_quaternion_of_zeros_is_refused_however_it_is_given() -> None:
    command = np.array([-0.1, 0, 0.5, 0, 0, 0, 0, 0, 0], np.float64)
    given_as = {"cartesian_command": command[:7], "gripper_command": command[7:]}
    ways: list[Callable[[], object]] = [
        lambda: CartesianControl().command(given_as),
        lambda: check_command(command, CartesianControl()),
        lambda: check_action(Action.hold(command, 50), CartesianControl()),
    ]
    for way in ways:
        with pytest.raises(ActionError, match="quaternion"):
            way()
    check_action(Action.rest(9), CartesianControl())  # no command is fine


def test_actions_can_be_asked_whether_they_are_the_same() -> None:
    one = Action.macro([[0.0, 0.0], [0.1, 0.1]])
    assert one == one
    assert one != Action.macro([[0.0, 0.0], [0.1, 0.1]])
    assert len({one, one}) == 1
