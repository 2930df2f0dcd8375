from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box

from real_bench.actions import Action, check_action
from real_bench.conditions import CONDITION_NAMES, Condition
from real_bench.real_x import RandomExplorer
from real_bench.simulation import HOME, Scene
from real_bench.spaces import action_space


def draws(space: Any, seed: int, n: int = 200) -> list[Action]:
    explorer = RandomExplorer(space, np.random.default_rng(seed))
    return [explorer.next_action() for _ in range(n)]


def chosen(action: Action, control: str) -> np.ndarray:
    """The commands that were drawn, without the way home."""
    return action.commands[:-1] if control == "J" else action.commands


@pytest.mark.parametrize("name", CONDITION_NAMES)
def test_actions_are_whole_and_within_the_space(builtin_scene: Scene, name: str) -> None:
    condition = Condition.parse(name)
    space = action_space(builtin_scene, condition)
    for action in draws(space, seed=0):
        checked = check_action(action, condition.control_type())
        assert (checked.commands == action.commands).all()
        assert (checked.n_steps == action.n_steps).all()
        assert action.duration == 1000
        for command in chosen(action, condition.control):
            assert space.contains(as_dict(command, condition.control))


def as_dict(command: np.ndarray, control: str) -> dict[str, Any]:
    render = np.zeros(1, np.int8)
    if control == "M":
        return {"macro_action": command.reshape(2, 2), "render": render}
    if control == "J":
        return {"joint_command": command, "render": render}
    return {"cartesian_command": command[:7], "gripper_command": command[7:], "render": render}


@pytest.mark.parametrize("name", ["OM", "OJ", "OC"])
def test_the_same_seed_gives_the_same_actions(builtin_scene: Scene, name: str) -> None:
    space = action_space(builtin_scene, Condition.parse(name))
    one, same, other = (draws(space, seed, n=20) for seed in (3, 3, 4))
    for mine, twin in zip(one, same, strict=True):
        np.testing.assert_array_equal(mine.commands, twin.commands)
        np.testing.assert_array_equal(mine.n_steps, twin.n_steps)
    assert one[0].commands.tobytes() != other[0].commands.tobytes()
    assert len({action.commands.tobytes() for action in one}) == len(one)


@pytest.mark.parametrize("name", ["OM", "OJ"])
def test_draws_fill_the_space(builtin_scene: Scene, name: str) -> None:
    condition = Condition.parse(name)
    space = action_space(builtin_scene, condition)
    box = space["macro_action" if name == "OM" else "joint_command"]
    drawn = np.vstack([chosen(action, condition.control) for action in draws(space, 0, 1000)])
    assert isinstance(box, Box)
    low, high = box.low.reshape(-1), box.high.reshape(-1)
    np.testing.assert_allclose(drawn.min(axis=0), low, atol=0.02 * (high - low).max())
    np.testing.assert_allclose(drawn.max(axis=0), high, atol=0.02 * (high - low).max())
    middle = (low + high) / 2
    np.testing.assert_allclose(drawn.mean(axis=0), middle, atol=0.04 * (high - low).max())


@pytest.mark.parametrize("name", ["OJ", "OC"])
def test_one_to_ten_points_are_equally_likely(builtin_scene: Scene, name: str) -> None:
    condition = Condition.parse(name)
    actions = draws(action_space(builtin_scene, condition), seed=1, n=1000)
    counts = np.bincount([len(chosen(action, condition.control)) for action in actions])
    assert counts[0] == 0
    assert len(counts) == 11
    assert counts[1:].min() > 60


def test_joint_actions_end_at_home(builtin_scene: Scene) -> None:
    for action in draws(action_space(builtin_scene, Condition.parse("OJ")), seed=0, n=20):
        np.testing.assert_array_equal(action.commands[-1], HOME)
        assert action.n_steps[-1] == 150
        assert action.line.tolist() == [True] * (len(action.commands) - 1) + [False]


def test_hand_orientations_are_uniform(builtin_scene: Scene) -> None:
    actions = draws(action_space(builtin_scene, Condition.parse("OC")), seed=0, n=1000)
    quaternions = np.vstack([action.commands[:, 3:7] for action in actions])
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose(quaternions.mean(axis=0), 0, atol=0.03)
    np.testing.assert_allclose((quaternions**2).mean(axis=0), 0.25, atol=0.02)


def test_poses_share_the_time_equally(builtin_scene: Scene) -> None:
    for action in draws(action_space(builtin_scene, Condition.parse("OC")), seed=0, n=50):
        assert action.n_steps.max() - action.n_steps.min() <= 1
