"""The Gymnasium face of the benchmark."""

from __future__ import annotations

import copy
import gc
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

import real_bench
from real_bench.conditions import CONDITION_NAMES, ConditionError
from real_bench.errors import ActionError, GoalSetError, RealBenchError, SceneError
from real_bench.goal_sets import GoalSet, generate_goal_set, save_goal_set
from real_bench.simulation import Scene, Simulation
from real_bench.simulation.bullet import pybullet
from real_bench.simulation.scene import manifest_path

TOLD_WITH_O = {"mask", "goal_mask", "object_positions", "object_orientations", "goal_positions"}
ALWAYS_TOLD = {"joint_positions", "touch_sensors", "retina", "depth", "goal"}


@pytest.fixture(scope="module")
def goals(builtin_scene: Scene) -> GoalSet:
    return generate_goal_set(builtin_scene, 2, 5, counts={"2D": 2, "2.5D": 0, "3D": 0})


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("objects", [1, 3])
@pytest.mark.parametrize("condition", CONDITION_NAMES)
def test_environment_passes_the_gymnasium_checker(condition: str, objects: int) -> None:
    env = gymnasium.make(
        f"RealBench/REAL-{condition}-v0", objects=objects, scene="builtin", render_mode="rgb_array"
    )
    check_env(env.unwrapped, skip_render_check=True)  # which would open pybullet's window
    env.close()


@pytest.mark.parametrize("condition", CONDITION_NAMES)
def test_every_observation_is_in_its_space(condition: str) -> None:
    env = real_bench.make_env(scene="builtin", condition=condition, objects=2)
    observation, _ = env.reset(seed=1)
    assert observation in env.observation_space
    env.action_space.seed(1)
    for _ in range(30):
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        assert observation in env.observation_space
        assert (reward, terminated, truncated) == (0.0, False, False)
    env.close()


@pytest.mark.parametrize("condition", CONDITION_NAMES)
def test_only_conditions_with_o_see_objects(condition: str) -> None:
    env = real_bench.make_env(scene="builtin", condition=condition)
    observation, _ = env.reset()
    told = ALWAYS_TOLD | TOLD_WITH_O if condition[0] == "O" else ALWAYS_TOLD
    assert isinstance(env.observation_space, gymnasium.spaces.Dict)
    assert set(observation) == set(env.observation_space.spaces) == told
    env.close()


def test_images_are_zeros_unless_asked_for() -> None:
    env = real_bench.make_env(scene="builtin", condition="OJ")
    first, _ = env.reset()
    assert first["retina"].any()
    unasked = env.step({"joint_command": None})[0]
    assert not unasked["retina"].any()
    assert not unasked["mask"].any()
    asked = env.step({"joint_command": None, "render": np.array([1])})[0]
    assert asked["retina"].any()
    assert asked["depth"].any()
    env.close()


def test_observations_share_no_memory() -> None:
    env = real_bench.make_env(scene="builtin", condition="OJ")
    first, _ = env.reset()
    second = env.step({"joint_command": [0.5] * 9, "render": 1})[0]
    for key in ("joint_positions", "retina", "goal", "depth", "mask"):
        assert not np.shares_memory(first[key], second[key])
    env.close()


def test_repeated_episode_is_the_same() -> None:
    def play(env: Any) -> list[np.ndarray]:
        env.reset(seed=3)
        env.action_space.seed(3)
        return [env.step(env.action_space.sample())[0]["joint_positions"] for _ in range(50)]

    env = real_bench.make_env(scene="builtin", condition="IJ")
    first = play(env)
    assert all(np.array_equal(a, b) for a, b in zip(first, play(env), strict=True))
    env.close()


def test_play_has_no_goal() -> None:
    env = real_bench.make_env(scene="builtin", condition="OM")
    observation, _ = env.reset()
    assert not observation["goal"].any()
    assert not observation["goal_positions"]["cube"].any()
    env.close()


def test_trial_shows_its_goal_ends_in_time_and_is_scored(goals: GoalSet) -> None:
    env = real_bench.make_env(scene="builtin", condition="OM", objects=2, goals=goals, max_steps=20)
    for goal in goals.goals:
        observation, _ = env.reset()
        assert np.array_equal(observation["goal"], goal.retina)
        assert np.array_equal(observation["retina"], goal.retina_before)
        assert np.array_equal(
            np.array(list(observation["object_positions"].values())), goal.initial_poses[:, :3]
        )
        for step in range(1, 21):
            _, _, terminated, truncated, info = env.step({"macro_action": None})
            assert not terminated
            assert truncated == (step == 20)
        assert 0 < info["score"] < 0.2
    for wrong in ({"gaol": 1}, [1]):
        with pytest.raises(RealBenchError, match=r"options of reset\(\) may be"):
            env.reset(options=wrong)  # type: ignore[arg-type]
    again, _ = env.reset(options={"goal": 1})
    assert np.array_equal(again["goal"], goals.goals[1].retina)
    env.close()


def test_the_camera_can_be_rendered() -> None:
    env = real_bench.make_env(scene="builtin", condition="IM", render_mode="rgb_array")
    env.reset()
    picture = env.render()
    assert picture is not None
    assert picture.shape == (240, 320, 3)
    assert picture.dtype == np.uint8
    env.close()


def test_window_without_a_display_raises_a_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(SceneError, match="no display"):
        real_bench.make_env(scene="builtin", render_mode="human")


def test_wrong_arguments_are_named(goals: GoalSet) -> None:
    for name in ("RealBench/REAL-OM-v0", "RealBench/REAL-OM-Action-v0"):
        with pytest.raises(GoalSetError, match=r"use objects=2, or other goals$"):
            gymnasium.make(name, scene="builtin", goals=goals)
    with pytest.raises(ConditionError, match="'XM': use one of OM"):
        real_bench.make_env(scene="builtin", condition="XM")
    with pytest.raises(SceneError, match="not 4"):
        real_bench.make_env(scene="builtin", objects=4)
    env = real_bench.make_env(scene="builtin", condition="OM")
    env.reset()
    with pytest.raises(ActionError, match="macro_action"):
        env.step({"joint_command": [0] * 9})
    env.close()


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickle.dumps])
def test_environments_and_simulations_cannot_be_copied(
    copied: Callable[[Any], Any], builtin_scene: Scene
) -> None:
    env = real_bench.make_env(scene="builtin", condition="OJ")
    env.reset()
    with Simulation(builtin_scene) as simulation:
        for world in (env, env._task, simulation):
            with pytest.raises(SceneError, match=r"copied|two objects"):
                copied(world)
    env.close()


def test_simulation_ends_with_its_last_reference() -> None:
    """Whether or not they were closed; one that could not be begun, too."""
    clients = []
    for _ in range(3):
        env = real_bench.make_env(scene="builtin", condition="OM")
        env.reset()
        clients.append(env._task.simulation.client)
        del env
    gc.collect()
    assert not any(pybullet.getConnectionInfo(client)["isConnected"] for client in clients)


def test_closing_a_simulation_leaves_later_ones_alone(builtin_scene: Scene) -> None:
    first = Simulation(builtin_scene)
    first.close()
    with Simulation(builtin_scene) as second:  # of the same number, perhaps
        first.close()
        del first
        gc.collect()
        assert pybullet.getConnectionInfo(second.client)["isConnected"]


def test_environment_made_from_paths_survives_its_spec(goals: GoalSet, tmp_path: Path) -> None:
    save_goal_set(goals, tmp_path / "goals.npy")
    scene = manifest_path("builtin")
    env = gymnasium.make(
        "RealBench/REAL-OM-v0", objects=2, scene=scene, goals=tmp_path / "goals.npy"
    )
    spec = env.spec
    assert spec is not None
    told = spec.to_json()
    again = gymnasium.make(EnvSpec.from_json(told))
    assert np.array_equal(env.reset()[0]["goal"], again.reset()[0]["goal"])
    env.close()
    again.close()


def test_a_closed_world_does_not_show_another_one() -> None:
    """pybullet gives the number of a closed world to the next one."""
    closed = real_bench.make_env(scene="builtin", render_mode="rgb_array")
    closed.reset()
    simulation = closed._task.simulation
    closed.close()
    other = real_bench.make_env(scene="builtin", objects=3)
    other.reset()
    for ask in (
        closed.render,
        simulation.joint_positions,
        simulation.touch_sensors,
        simulation.contacts,
        simulation.image,
    ):
        with pytest.raises(SceneError, match="is closed"):
            ask()
    other.close()


@pytest.mark.parametrize("goal", [1.5, "1", None, -1, 2, np.array([0, 1])])
def test_goals_are_chosen_by_their_numbers(goals: GoalSet, goal: Any) -> None:
    env = real_bench.make_env(scene="builtin", objects=2, goals=goals)
    with pytest.raises(RealBenchError, match="goal must be a whole number from 0 to 1"):
        env.reset(options={"goal": goal})
    env.reset(options={"goal": np.int64(1)})
    env.close()


def test_a_goal_needs_goals() -> None:
    env = real_bench.make_env(scene="builtin")
    with pytest.raises(RealBenchError, match="give the environment goals"):
        env.reset(options={"goal": 0})
    env.close()
