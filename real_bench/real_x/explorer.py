"""The Explorer in its basic version: random actions (paper, section REAL-X blueprint, Explorer)."""

from __future__ import annotations

from typing import Any

import numpy as np

from real_bench.actions import Action
from real_bench.controls import control_of


class RandomExplorer:
    """Draws each action uniformly from an action space, each lasting 1000 steps.

    With macros: two points. With joints: 1 to 10 via points. With cartesian commands: 1 to 10
    poses of the gripper, each with a random orientation, for equal parts of the action.

    Args:
        action_space: of the condition; a dict of boxes.
        random: the generator for drawing.
    """

    def __init__(self, action_space: Any, random: np.random.Generator) -> None:
        self._control, self._boxes = control_of(action_space), action_space.spaces
        self._random = random

    def next_action(self) -> Action:
        """A random action."""
        return self._control.random_action(self._boxes, self._random)
