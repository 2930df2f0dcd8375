"""A push with joints, through postures that the robot has learned by watching its hand."""

from __future__ import annotations

import numpy as np

from real_bench.actions import Action
from real_bench.real_g.arrays import Array
from real_bench.real_g.reach import Planes

N_ALONG = 14
"""Postures along the line."""

ABOVE, DOWN, ALONG, UP, HOME = 100, 60, 20, 50, 170
"""Steps for which postures are held; those along the line each."""

N_JOINTS = 9

TOLERANCE = 1e-6
"""Commands that differ more from a push's, radians, are no push."""


class JointPush:
    """Above a first point, down, in a line to a second one, up, home: x1, y1, x2, y2.

    Args:
        planes: postures by the hand's coordinates; the gripper stays closed.
    """

    start, end = (0, 1), (2, 3)
    goal: tuple[int, ...] = end
    yaw: int | None = None
    height: int | None = None
    tilts: tuple[int, ...] = ()
    place_scale: float | None = 0.5  # where the map errs, it errs otherwise elsewhere
    steps = ABOVE + DOWN + N_ALONG * ALONG + UP + HOME

    def __init__(self, planes: Planes) -> None:
        self._planes = planes
        self.low, self.high = np.tile(planes.low, 2), np.tile(planes.high, 2)

    def action(self, parameters: Array) -> Action:
        """The push from the first point to the second."""
        first, second = parameters[None, :2], parameters[None, 2:]
        part = np.arange(1, N_ALONG + 1)[:, None] / N_ALONG
        arm = np.concatenate(
            [
                self._planes.raised(first),
                self._planes.near(np.vstack([first, first + (second - first) * part])),
                self._planes.raised(second),
                np.zeros((1, N_JOINTS - 2)),
            ]
        )
        commands = np.column_stack([arm, np.zeros((len(arm), 2))])
        n_steps = np.array([ABOVE, DOWN, *[ALONG] * N_ALONG, UP, HOME])
        return Action(commands, n_steps, np.zeros(len(commands), bool))

    def parameters(self, action: Action) -> Array | None:
        """The two points, (4,); None if it is no whole push."""
        if action.duration != self.steps or len(action.commands) != N_ALONG + 4:
            return None
        ends = action.commands[[1, N_ALONG + 1], : N_JOINTS - 2]
        points = np.concatenate([self._planes.position(end) for end in ends])
        commands = self.action(points).commands
        return points if np.allclose(commands, action.commands, rtol=0, atol=TOLERANCE) else None

    def path(self, parameters: Array) -> Array:
        """The two points, (2, 2)."""
        return parameters.reshape(2, 2)

    def rest(self) -> Action:
        """No command: go home and stay there."""
        return Action.rest(N_JOINTS, self.steps)
