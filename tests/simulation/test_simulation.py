"""Laws of the simulated world."""

from __future__ import annotations

import re

import numpy as np
import pytest

from real_bench.actions import Action
from real_bench.conditions import Condition
from real_bench.controls.macro import plan_macro
from real_bench.errors import PhysicsError, SceneError
from real_bench.simulation import HOME, Scene, Simulation
from real_bench.simulation.bullet import pybullet
from real_bench.task import Task

PUSH = (-0.1, 0.2, -0.1, -0.2)


def pushed(simulation: Simulation) -> np.ndarray:
    simulation.follow(plan_macro(PUSH, simulation))
    return np.concatenate([simulation.object_poses().ravel(), simulation.joint_positions()])


def test_the_same_commands_give_the_same_bits(builtin_scene: Scene) -> None:
    with Simulation(builtin_scene) as first, Simulation(builtin_scene) as second:
        assert np.array_equal(pushed(first), pushed(second))


def test_a_fresh_world_remembers_nothing(builtin_scene: Scene) -> None:
    with Simulation(builtin_scene, 2) as simulation, Simulation(builtin_scene, 3) as other:
        once = pushed(simulation)
        pushed(other)
        simulation.reset()
        assert np.array_equal(pushed(simulation), once)


def test_holding_in_parts_equals_holding_at_once(builtin_scene: Scene) -> None:
    command = (0.4, 0.9, 0.0, -0.7, 0.0, 1.2, 0.3, 0.2, 0.1)
    with Simulation(builtin_scene) as whole, Simulation(builtin_scene) as parts:
        whole.hold(command, 200)
        for n_steps in (1, 99, 3, 97):
            parts.hold(command, n_steps)
        assert np.array_equal(whole.joint_positions(), parts.joint_positions())


def test_looking_changes_nothing(builtin_scene: Scene) -> None:
    with Simulation(builtin_scene) as blind, Simulation(builtin_scene) as watched:
        for _ in range(5):
            blind.hold(HOME, 20)
            watched.hold(HOME, 20)
            watched.image()
            watched.touch_sensors()
        assert np.array_equal(pushed(blind), pushed(watched))


@pytest.mark.parametrize(
    ("position", "falls"),
    [((0.0, 0.9, 0.3), True), ((0.2, 0.8, 0.2), True), ((-0.1, 0.1, 0.4), False)],
)
def test_objects_that_fall_off_the_table_are_put_back(
    builtin_scene: Scene, position: tuple[float, float, float], falls: bool
) -> None:
    poses = np.array([[*position, 0, 0, 0, 1.0]])
    with Simulation(builtin_scene) as simulation:
        start = simulation.object_poses()[0, :2]
        simulation.reset(poses)
        simulation.hold(HOME, 300)
        assert (simulation.n_put_back > 0) == falls
        back = np.allclose(simulation.object_poses()[0, :2], start, atol=0.02)
        assert back == falls


def test_commands_are_clipped_to_their_range(builtin_scene: Scene) -> None:
    limits = builtin_scene.manifest.limits
    with Simulation(builtin_scene) as simulation:
        simulation.hold((9.0, 0, 0, 0, 0, 0, -9.0, 0, 0), 600)
        joints = simulation.joint_positions()
    assert joints[0] == pytest.approx(limits.command_high[0], abs=0.01)
    assert joints[6] == pytest.approx(limits.command_low[6], abs=0.01)


def test_nan_pose_raises_a_physics_error(builtin_scene: Scene) -> None:
    poses = np.array([[-0.1, 0, np.nan, 0, 0, 0, 1.0]])
    with Simulation(builtin_scene) as simulation:
        simulation.reset(poses)
        with pytest.raises(PhysicsError, match="exploded"):
            simulation.hold(HOME, 1)
        with pytest.raises(PhysicsError, match="exploded"):
            simulation.object_poses()


@pytest.mark.parametrize("step", [0, 430, 999])
def test_explosion_is_reported_with_its_steps_and_commands(builtin_scene: Scene, step: int) -> None:
    task = Task(builtin_scene, Condition.parse("OM"))
    simulation, nowhere = task.simulation, (0.0, 0.0, float("nan"))

    def explode() -> None:
        if task.n_steps == 1001 + step:
            pybullet.resetBasePositionAndOrientation(
                simulation._bodies[0], nowhere, (0, 0, 0, 1), physicsClientId=simulation.client
            )

    task.begin()
    task.execute(Action.macro(PUSH))
    task.watch(explode, 1)
    with pytest.raises(PhysicsError) as caught:
        task.execute(Action.macro([0.0, 0.1, 0.0, -0.1]))
    task.close()
    told = re.search(r"between steps ([\d,]+) and ([\d,]+) of this world", str(caught.value))
    assert told is not None
    first, last = (int(number.replace(",", "")) for number in told.groups())
    assert first <= 1001 + step <= last <= first + 101
    assert "the action that began at step 1,000 is [[0.0, 0.1, 0.0, -0.1]]" in str(caught.value)
    commanded = re.findall(r"\[[^\[\]]*\] from step ([\d,]+) on", str(caught.value))
    assert any(int(number.replace(",", "")) <= 1001 + step for number in commanded)


def test_exploding_step_is_reported_with_its_command(builtin_scene: Scene) -> None:
    task = Task(builtin_scene, Condition.parse("OM"))
    task.begin(object_poses=np.array([[0, 0, np.nan, 0, 0, 0, 1.0]]))
    with pytest.raises(PhysicsError, match=r"command that began at step 0 is \[-0.1, 0.2, -0.1"):
        task.step(np.array(PUSH))
    task.close()


def test_nan_joints_raise_a_physics_error(builtin_scene: Scene) -> None:
    with Simulation(builtin_scene) as simulation:
        simulation.robot.set_joint_positions(np.full(9, np.nan))
        with pytest.raises(PhysicsError, match="joint positions are"):
            simulation.joint_positions()


@pytest.mark.parametrize("n_objects", [0, 4, -1])
def test_the_number_of_objects_is_checked(builtin_scene: Scene, n_objects: int) -> None:
    with pytest.raises(SceneError, match=f"from 1 to 3, not {n_objects}"):
        Simulation(builtin_scene, n_objects)


def test_using_a_closed_simulation_raises(builtin_scene: Scene) -> None:
    simulation = Simulation(builtin_scene)
    simulation.close()
    simulation.close()
    with pytest.raises(SceneError, match="closed"):
        simulation.hold(HOME, 1)
