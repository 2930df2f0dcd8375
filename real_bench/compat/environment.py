"""The official environment: one step per call, four values back, and what scripts call."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from real_bench import goal_sets
from real_bench.actions import wants_render
from real_bench.compat.evaluation import read_goals
from real_bench.compat.names import official_condition
from real_bench.errors import GoalSetError
from real_bench.lengths import INTRINSIC_STEPS, TRIAL_STEPS
from real_bench.phases.official import OfficialActions, official_observation, official_space
from real_bench.scoring.metric import goal_score
from real_bench.simulation import STEP_S, load_scene
from real_bench.simulation.simulation import TABLE
from real_bench.task import Task
from real_bench.text.counting import counted

Named = dict[str, NDArray[np.float64]]


@dataclass
class Goal:
    """A goal under the official names; in free play all but the image are None.

    Attributes:
        initial_state: each object's pose at the start, (7,).
        final_state: where each should end, (3,) metres.
        retina, retina_before: the camera's image of either.
        challenge: 2D, 2.5D or 3D.
        mask: the image's body ids.
    """

    initial_state: Named | None = None
    final_state: Named | None = None
    retina: NDArray[np.uint8] | None = None
    retina_before: NDArray[np.uint8] | None = None
    challenge: str | None = None
    mask: NDArray[np.int32] | None = None

    @classmethod
    def of(cls, goal: goal_sets.Goal, names: tuple[str, ...]) -> Goal:
        """One of our goals."""
        starts = dict(zip(names, goal.initial_poses.copy(), strict=True))
        ends = dict(zip(names, goal.final_poses[:, :3].copy(), strict=True))
        mask = goal.mask.astype(np.int32)
        return cls(
            starts, ends, goal.retina.copy(), goal.retina_before.copy(), goal.challenge, mask
        )


class REALRobotEnv(gymnasium.Env[dict[str, Any], dict[str, Any]]):
    """REAL as the official package has it: ``step`` returns observation, reward, done and info.

    ``set_goal`` begins a trial with the next goal of ``set_goals_dataset_path``; ``done`` is true
    at and after the last step of ``intrinsic_timesteps``, or of a trial's ``extrinsic_timesteps``.

    Args:
        render: open pybullet's window.
        objects: 1 to 3.
        action_type: joints, cartesian or macro_action.
        additional_obs: whether positions and masks are observed.

    Raises:
        RealBenchError: an argument is wrong, or scene official is not installed.
    """

    metadata = {"render_modes": ["human", "rgb_array"], "render_fps": round(1 / STEP_S)}  # noqa: RUF012

    def __init__(
        self,
        render: bool = False,
        objects: int = 3,
        action_type: str = "joints",
        additional_obs: bool = True,
    ) -> None:
        condition = official_condition("R1" if additional_obs else "R2", action_type)
        self._task = Task(load_scene("official"), condition, objects, gui=render)
        self._actions = OfficialActions("of this environment", self._task.control)
        self.robot = Robot(self._task)
        self.action_space = self._task.action_space
        self.observation_space = official_space(self._task.observation_space)
        self.intrinsic_timesteps, self.extrinsic_timesteps = INTRINSIC_STEPS, TRIAL_STEPS
        self.extrinsic_trials = 50
        self.goals_dataset_path = ""
        self.goals: list[goal_sets.Goal] | None = None
        self.goal_idx = -1
        self.goal = Goal(retina=np.zeros(self.observation_space["goal"].shape or (), np.uint8))

    @property
    def timestep(self) -> int:
        """Steps since ``reset`` or ``set_goal``."""
        return self._task.n_steps

    def reset(self) -> dict[str, Any]:  # type: ignore[override]
        """A fresh world with the objects at their start; the goal stays. The first observation."""
        goal = self._task.goal
        self._task.begin()
        self._task.goal = goal
        return self.get_observation()

    def step(  # type: ignore[override]
        self, action: Mapping[str, Any]
    ) -> tuple[dict[str, Any], int, bool, dict[str, Any]]:
        """One step of 5 ms; raises ActionError for an action that is not one."""
        action = self._actions.drop_unknown_keys(action)
        self._task.step(self._task.control.command(action))
        observation = self.get_observation(camera_on=wants_render(action))
        playing = self._task.goal is None
        last = self.intrinsic_timesteps if playing else self.extrinsic_timesteps
        return observation, 0, self.timestep >= last, {}

    def get_observation(self, camera_on: bool = True) -> dict[str, Any]:
        """What is observed now; images are zeros unless the camera is on."""
        return official_observation(self._task.observe(render=camera_on))

    def get_retina(self) -> tuple[NDArray[np.uint8], NDArray[np.int32], NDArray[np.float32]]:
        """The camera's image, body ids and depth."""
        image = self._task.simulation.image()
        return image.retina, image.mask, image.depth

    def render(self, mode: str = "human") -> NDArray[Any]:
        """The camera's image in mode ``rgb_array``; else nothing, the window updates itself."""
        return self.get_retina()[0] if mode == "rgb_array" else np.array([])

    def close(self) -> None:
        """Close the simulation."""
        self._task.close()

    def seed(self, seed: int | None = None) -> list[int | None]:
        """Nothing here is random."""
        return [seed]

    def set_goals_dataset_path(self, path: str | Path) -> None:
        """Take goals from an official or a realbench goal file, starting with the first."""
        self.goals_dataset_path, self.goals, self.goal_idx = str(path), None, -1

    def load_goals(self) -> None:
        """Read the goal file; raises GoalSetError."""
        if not self.goals_dataset_path:
            raise GoalSetError("no goals: call set_goals_dataset_path() first")
        scene = self._task.simulation.scene
        goals = read_goals(Path(self.goals_dataset_path), scene)
        goals.check_fits(scene, len(self._task.simulation.object_names))
        self.goals = list(goals.goals)

    def set_goal(self) -> dict[str, Any]:
        """Begin a trial with the next goal; its first observation. IndexError after the last."""
        if self.goals is None:
            self.load_goals()
        assert self.goals is not None
        if self.goal_idx + 1 >= len(self.goals):
            raise IndexError(
                f"{self.goals_dataset_path} has only {counted(len(self.goals), 'goal')}"
            )
        self.goal_idx += 1
        goal = self.goals[self.goal_idx]
        self.goal = Goal.of(goal, self._task.simulation.object_names)
        self._task.begin(goal)
        return self.get_observation()

    def evaluateGoal(self) -> tuple[str, float]:  # noqa: N802  the official name
        """The present goal's class, and its score for the objects' present positions."""
        goal = self._task.goal
        if goal is None:
            raise GoalSetError("no goal yet: call set_goal() first")
        positions = self._task.simulation.object_poses()[:, :3]
        return goal.challenge, goal_score(positions, goal.final_poses[:, :3])

    def get_obj_pose(self, name: str) -> NDArray[np.float64]:
        """Position and quaternion of an object or the table, (7,); raises KeyError."""
        return self._poses()[name]

    def get_obj_pos(self, name: str) -> NDArray[np.float64]:
        """Position of an object or the table, (3,) metres; raises KeyError."""
        return self._poses()[name][:3]

    def get_all_used_objects(self) -> Named:
        """The position of every object, by name."""
        return {name: pose[:3] for name, pose in self._poses().items() if name != TABLE}

    def get_part_pos(self, name: str) -> NDArray[np.float64]:
        """Position of a link of the robot, (3,) metres; raises KeyError."""
        return self._task.simulation.robot.link_position(name)

    def get_contacts(self) -> dict[str, list[str]]:
        """What touches the robot: a link's name, and an object's for each point of contact."""
        return self.robot.get_contacts()

    def _poses(self) -> Named:
        simulation = self._task.simulation
        table = np.array([*simulation.scene.manifest.table.position, 0.0, 0.0, 0.0, 1.0])
        named = zip(simulation.object_names, simulation.object_poses(), strict=True)
        return {TABLE: table, **dict(named)}


class Robot:
    """The environment's robot, with the methods that scripts use."""

    num_kuka_joints, num_gripper_joints = 7, 2
    num_joints = action_dim = num_kuka_joints + num_gripper_joints

    def __init__(self, task: Task) -> None:
        self._task = task
        self.used_objects = [TABLE, *task.simulation.object_names]

    def get_contacts(self) -> dict[str, list[str]]:
        """The same as the environment's method."""
        return self._task.simulation.contacts()

    def get_touch_sensors(self) -> NDArray[np.float64]:
        """The largest normal force on each of the four skins, (4,) newtons."""
        return self._task.simulation.touch_sensors()
