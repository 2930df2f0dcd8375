"""REAL-R: random actions, the baseline (paper, section REAL-X architectures)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from real_bench.actions import Action
from real_bench.controller import Controller, State

MOST_VIA_POINTS = 10


class RealR(Controller):
    """Draws each action uniformly from the action space, whatever it sees.

    With macros: two points. With joints: 1 to 10 via points. With cartesian commands: 1 to 10
    poses of the gripper, each with a random orientation, for equal parts of the action.
    """

    def __init__(self, action_space: Any, observation_space: Any) -> None:
        super().__init__(action_space, observation_space)
        self._spaces = action_space.spaces
        self.seed(0)

    def seed(self, seed: int) -> None:
        """Begin the random sequence of this seed."""
        self._random = np.random.default_rng(seed)

    def get_state(self) -> State:
        """Where in its random sequence it is."""
        return {"random": self._random.bit_generator.state}

    def set_state(self, state: State) -> None:
        """Go on in the random sequence."""
        self._random.bit_generator.state = state["random"]

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        """A random action of 1000 steps."""
        if "macro_action" in self._spaces:
            return Action.macro(self._draw("macro_action"))
        n_points = int(self._random.integers(1, MOST_VIA_POINTS, endpoint=True))
        if "joint_command" in self._spaces:
            return Action.via_points([self._draw("joint_command") for _ in range(n_points)])
        return Action.poses([self._draw_pose() for _ in range(n_points)])

    def _draw(self, key: str) -> np.ndarray[Any, Any]:
        space = self._spaces[key]
        return self._random.uniform(space.low, space.high)

    def _draw_pose(self) -> np.ndarray[Any, Any]:
        pose = self._draw("cartesian_command")
        quaternion = self._random.normal(size=4)  # uniform on the sphere once it has unit length
        pose[3:] = quaternion / np.linalg.norm(quaternion)
        return np.concatenate([pose, self._draw("gripper_command")])
