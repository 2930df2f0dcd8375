"""What a controller faces: one world, under one condition, with or without a goal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action, Command, action_segments
from real_bench.conditions import Condition
from real_bench.errors import PhysicsError, SceneError
from real_bench.goal_sets import Goal
from real_bench.observation import CAMERA_KEYS, Observation
from real_bench.simulation import Image, Segment, Simulation
from real_bench.simulation.scene import Scene
from real_bench.simulation.simulation import SHOWN_COMMANDS
from real_bench.spaces import action_space, observation_space

Watcher = Callable[[], None]


class Task:
    """A simulation seen and driven as a condition allows.

    Args:
        scene: the scene.
        condition: what is perceived and how the robot is controlled.
        n_objects: from 1 to the number of objects in the scene.
        gui: show pybullet's window.
    """

    def __init__(
        self, scene: Scene, condition: Condition, n_objects: int = 1, *, gui: bool = False
    ) -> None:
        self.condition = condition
        self.simulation = Simulation(scene, n_objects, gui=gui)
        self.control = condition.control_type()
        self.action_space = action_space(scene, condition)
        self.observation_space = observation_space(scene, condition, n_objects)
        self.goal: Goal | None = None
        self.n_steps = 0
        self._n_worlds = 0
        self._watcher: Watcher | None = None
        self._watch_every = 0
        self._observation: Observation | None = None

    def begin(
        self,
        goal: Goal | None = None,
        *,
        object_poses: NDArray[np.float64] | None = None,
        joint_positions: NDArray[np.float64] | None = None,
    ) -> None:
        """Begin in a fresh world: at the goal's start, or at the given poses and joints."""
        self.goal = goal
        poses = object_poses if goal is None else goal.initial_poses
        self.simulation.reset(poses, joint_positions)
        self.control.reset()
        self.n_steps = 0
        self._n_worlds += 1
        self._expire()

    def watch(self, watcher: Watcher | None, every: int) -> None:
        """Call ``watcher`` after every ``every`` steps (e.g. to film)."""
        self._watcher, self._watch_every = watcher, every

    def step(self, command: Command) -> None:
        """One step of one command; raises PhysicsError."""
        began = self.n_steps
        try:
            self._follow(self.control.segments(command, 1, self.simulation))
        except PhysicsError as error:
            raise _with_context(error, "command", command, began) from error

    def execute(self, action: Action) -> None:
        """A whole action, already checked (see :func:`real_bench.actions.check_action`).

        Raises:
            PhysicsError: the world exploded; the message has the steps and the action.
        """
        began = self.n_steps
        try:
            self._follow(action_segments(action, self.control, self.simulation))
            self.simulation.object_poses()  # finds explosions in the last steps
        except PhysicsError as error:
            raise _with_context(error, "action", action.commands[:SHOWN_COMMANDS], began) from error

    def observe(self, *, render: bool = True) -> Observation:
        """What is seen now; camera images are zeros if ``render`` is false."""
        self._expire()
        senses = self._senses(self._lazy_camera(render))
        dark = frozenset() if render else CAMERA_KEYS & senses.keys()
        self._observation = Observation(senses, dark, self._n_worlds, self.goal is not None)
        return self._observation

    def __copy__(self) -> NoReturn:
        raise SceneError("a task cannot be copied: make another one")

    def close(self) -> None:
        """Close the simulation."""
        self.simulation.close()

    def _follow(self, segments: Iterable[Segment]) -> None:
        self._expire()
        for command, n_steps in segments:
            if self._watcher is None:
                self.simulation.hold(command, n_steps)
                self.n_steps += n_steps
            else:
                self._hold_watched(command, n_steps, self._watcher)

    def _hold_watched(self, command: Any, n_steps: int, watcher: Watcher) -> None:
        while n_steps:
            part = min(n_steps, self._watch_every - self.n_steps % self._watch_every)
            self.simulation.hold(command, part)
            self.n_steps += part
            n_steps -= part
            if self.n_steps % self._watch_every == 0:
                watcher()

    def _expire(self) -> None:
        if self._observation is not None:
            self._observation.expire()

    def _lazy_camera(self, render: bool) -> Callable[[], Image]:
        """A camera that takes at most one picture."""
        pictures: list[Image] = []

        def picture() -> Image:
            if not pictures:
                pictures.append(self.simulation.image() if render else self._dark_image())
            return pictures[0]

        return picture

    def _dark_image(self) -> Image:
        """The image of a camera that is off; fresh zeros cost nothing until they are touched."""
        camera = self.simulation.scene.manifest.camera
        size = (camera.height, camera.width)
        return Image(
            np.zeros((*size, 3), np.uint8), np.zeros(size, np.float32), np.zeros(size, np.int32)
        )

    def _senses(self, picture: Callable[[], Image]) -> Mapping[str, Callable[[], Any]]:
        simulation = self.simulation
        senses: dict[str, Callable[[], Any]] = {
            "joint_positions": simulation.joint_positions,
            "touch_sensors": simulation.touch_sensors,
            "retina": lambda: picture().retina,
            "depth": lambda: picture().depth,
            "goal": self._goal_image,
        }
        if self.condition.sees_objects:
            senses |= {
                "mask": lambda: picture().mask,
                "goal_mask": self._goal_mask,
                "object_positions": lambda: self._by_object(simulation.object_poses()[:, :3]),
                "object_orientations": lambda: self._by_object(simulation.object_poses()[:, 3:]),
                "goal_positions": self._goal_positions,
            }
        return senses

    def _by_object(self, rows: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        return {
            name: row.copy() for name, row in zip(self.simulation.object_names, rows, strict=True)
        }

    def _goal_image(self) -> NDArray[np.uint8]:
        return self._dark_image().retina if self.goal is None else self.goal.retina.copy()

    def _goal_mask(self) -> NDArray[np.int32]:
        mask = self._dark_image().mask if self.goal is None else self.goal.mask
        return mask.astype(np.int32)

    def _goal_positions(self) -> dict[str, NDArray[np.float64]]:
        if self.goal is None:
            return self._by_object(np.zeros((len(self.simulation.object_names), 3)))
        return self._by_object(self.goal.final_poses[:, :3])


def _with_context(
    error: PhysicsError, what: str, numbers: NDArray[np.float64], began: int
) -> PhysicsError:
    shown = np.round(numbers, 6).tolist()
    return PhysicsError(f"{error}; the {what} that began at step {began:,} is {shown}")
