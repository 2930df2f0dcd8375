"""The environment of whole actions, as libraries of reinforcement learning use it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

import real_bench
from real_bench.action_environment import ActionEnv
from real_bench.errors import ActionError, RealBenchError
from real_bench.goal_sets import GoalSet, generate_goal_set, save_goal_set
from real_bench.simulation import Scene

NAMES = [f"RealBench/REAL-{condition}-Action-v0" for condition in ("OM", "IM")]


@pytest.fixture(scope="module")
def goals(builtin_scene: Scene) -> GoalSet:
    return generate_goal_set(builtin_scene, 2, 5, counts={"2D": 2, "2.5D": 0, "3D": 0})


def make(name: str = NAMES[0], **options: Any) -> gymnasium.Env[Any, Any]:
    return gymnasium.make(name, **{"scene": "builtin", **options})


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("objects", [1, 2])
def test_environment_passes_the_gymnasium_checker(name: str, objects: int, goals: GoalSet) -> None:
    for options in ({}, {"goals": goals} if objects == 2 else {}):
        env = make(name, objects=objects, render_mode="rgb_array", **options)
        check_env(env.unwrapped, skip_render_check=True)  # which would open pybullet's window
        env.close()


def test_action_matches_a_macro_of_the_stepwise_environment() -> None:
    whole, stepwise = make(objects=2), real_bench.make_env("OM", objects=2, scene="builtin")
    whole.reset(seed=0)
    stepwise.reset(seed=0)
    whole.action_space.seed(3)
    for _ in range(2):
        points = whole.action_space.sample()
        seen, reward, terminated, truncated, info = whole.step(points)
        for _ in range(1000):
            told, *_ = stepwise.step({"macro_action": points.reshape(2, 2), "render": False})
        assert (reward, terminated, truncated, info) == (0.0, False, False, {})
        for key in ("joint_positions", "touch_sensors"):
            np.testing.assert_array_equal(seen[key], told[key])
        for key in ("object_positions", "object_orientations"):
            np.testing.assert_array_equal(seen[key], np.concatenate([*told[key].values()]))
    whole.close()
    stepwise.close()


def test_same_seed_and_actions_give_the_same_observations() -> None:
    def play() -> list[Any]:
        env = make(NAMES[1], max_steps=2500)
        seen = [env.reset(seed=1)[0]]
        env.action_space.seed(1)
        seen += [env.step(env.action_space.sample())[0] for _ in range(3)]
        env.close()
        return seen

    for one, other in zip(play(), play(), strict=True):
        assert {key: value.tobytes() for key, value in one.items()} == {
            key: value.tobytes() for key, value in other.items()
        }


def test_an_episode_ends_after_its_steps(goals: GoalSet) -> None:
    env = make(objects=2, goals=goals, max_steps=1500)
    assert set(env.observation_space.spaces) >= {"goal_positions"}  # type: ignore[attr-defined]
    seen, _ = env.reset(seed=0)
    wanted = goals.goals[0].final_poses[:, :3].ravel()
    np.testing.assert_array_equal(seen["goal_positions"], wanted)
    push = np.array([-0.1, 0.2, -0.1, -0.2])
    assert env.step(push)[2:] == (False, False, {})
    *_, truncated, info = env.step(push)
    assert truncated
    assert 0 <= info["score"] <= 2
    seen, _ = env.reset(options={"goal": 0})
    np.testing.assert_array_equal(seen["goal_positions"], wanted)
    env.close()


@pytest.mark.parametrize("action", [[0.0, 0.0], [np.nan] * 4, [[0.1] * 4] * 2, "push", None])
def test_bad_actions_are_refused(action: Any) -> None:
    env = ActionEnv(scene="builtin")
    env.reset()
    with pytest.raises(ActionError):
        env.step(action)
    env.close()


def test_only_macro_conditions_are_accepted() -> None:
    with pytest.raises(RealBenchError, match="whole actions are for OM and IM, not OJ"):
        ActionEnv("OJ", scene="builtin")


def test_spec_survives_json(goals: GoalSet, tmp_path: Path) -> None:
    save_goal_set(goals, tmp_path / "goals.npy")
    env = make(objects=2, goals=tmp_path / "goals.npy")
    assert env.spec is not None
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    assert json.loads(env.spec.to_json())["kwargs"]["goals"] == str(tmp_path / "goals.npy")
    assert again.observation_space == env.observation_space
    env.close()
    again.close()


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_vector_environment_matches_single_ones(mode: str) -> None:
    several: Any = gymnasium.make_vec(
        NAMES[0], num_envs=2, vectorization_mode=mode, scene="builtin", max_steps=2000
    )
    several.reset(seed=[0, 1])
    several.action_space.seed(0)
    actions = [several.action_space.sample() for _ in range(2)]
    seen = [several.step(action)[0] for action in actions]
    several.close()
    for number in range(2):
        alone = make(max_steps=2000)
        alone.reset(seed=number)
        for action, told in zip(actions, seen, strict=True):
            expected = alone.step(action[number])[0]
            for key, value in expected.items():
                np.testing.assert_array_equal(told[key][number], value)
        alone.close()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", NAMES)
def test_environment_passes_the_stable_baselines_checker(name: str) -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    env = make(name, max_steps=3000)
    checker.check_env(env.unwrapped, skip_render_check=True)
    env.close()
