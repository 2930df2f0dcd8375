"""The Explorer in its basic version: random actions (paper, section REAL-X blueprint, Explorer)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action

MOST_VIA_POINTS = 10


class RandomExplorer:
    """Draws each action uniformly from an action space, each lasting 1000 steps.

    With macros: two points. With joints: 1 to 10 via points. With cartesian commands: 1 to 10
    poses of the gripper, each with a random orientation, for equal parts of the action.

    Args:
        action_space: of the condition; a dict of boxes.
        random: where the draws come from.
    """

    def __init__(self, action_space: Any, random: np.random.Generator) -> None:
        self._boxes = action_space.spaces
        self._random = random

    def next_action(self) -> Action:
        """A random action."""
        if "macro_action" in self._boxes:
            return Action.macro(self._draw("macro_action"))
        n_points = int(self._random.integers(1, MOST_VIA_POINTS, endpoint=True))
        if "joint_command" in self._boxes:
            return Action.via_points([self._draw("joint_command") for _ in range(n_points)])
        return Action.poses([self._draw_pose() for _ in range(n_points)])

    def _draw(self, key: str) -> NDArray[np.float64]:
        box = self._boxes[key]
        return np.asarray(self._random.uniform(box.low, box.high), np.float64)

    def _draw_pose(self) -> NDArray[np.float64]:
        pose = self._draw("cartesian_command")
        quaternion = self._random.normal(size=4)  # uniform on the sphere once it has unit length
        pose[3:] = quaternion / np.linalg.norm(quaternion)
        return np.concatenate([pose, self._draw("gripper_command")])
