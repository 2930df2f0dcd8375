"""Cartesian control: x, y, z (metres), quaternion (x, y, z, w), gripper base and tip (radians)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action, Command
from real_bench.controls.control import MAX_POINTS, Boxes, Control, box, check_keys, draw, vector
from real_bench.errors import ActionError
from real_bench.simulation.posture import HOME

if TYPE_CHECKING:
    from gymnasium import spaces

    from real_bench.simulation import Segment, Simulation
    from real_bench.simulation.manifest import CommandLimits


class CartesianControl(Control):
    """A pose of the gripper, by inverse kinematics, and the two gripper commands.

    The kinematics is solved again only when the pose changes from one step to the next.
    """

    letter, name, official_name = "C", "cartesian commands", "cartesian"
    size = 9
    keys = ("cartesian_command", "gripper_command")
    example = "Action.poses(commands), with commands of shape (n, 9)"

    @classmethod
    def boxes(cls, limits: CommandLimits) -> dict[str, spaces.Box]:
        """Position (metres) and quaternion (x, y, z, w), and the two gripper commands."""
        low, high = np.array(limits.command_low), np.array(limits.command_high)
        return {
            "cartesian_command": box(
                np.array([*limits.cartesian_low, -1, -1, -1, -1]),
                np.array([*limits.cartesian_high, 1, 1, 1, 1]),
            ),
            "gripper_command": box(low[7:], high[7:]),
        }

    @classmethod
    def random_action(cls, boxes: Boxes, random: np.random.Generator) -> Action:
        """1 to 10 poses of the gripper with random orientations, for equal parts of the action."""
        n_points = int(random.integers(1, MAX_POINTS, endpoint=True))
        return Action.poses([_random_pose(boxes, random) for _ in range(n_points)])

    def __init__(self) -> None:
        self._pose: tuple[float, ...] | None = None
        self._arm: tuple[float, ...] = ()

    def command(self, action: Mapping[str, Any]) -> Command:
        """The vector of ``{"cartesian_command": (7,), "gripper_command": (2,)}``, or of None."""
        check_keys(action, self.keys)
        pose, gripper = action["cartesian_command"], action["gripper_command"]
        if pose is None:
            return np.full(9, np.nan)
        if gripper is None:
            raise ActionError(
                "gripper_command is None but cartesian_command is not: give 2 numbers"
            )
        command = np.concatenate(
            [vector(pose, "cartesian_command", 7), vector(gripper, "gripper_command", 2)]
        )
        self.check(command[None])
        return command

    @classmethod
    def check(cls, commands: NDArray[np.float64]) -> None:
        """Raise ActionError if a quaternion is all zeros."""
        if not commands[:, 3:7].any(axis=1).all():
            raise ActionError("the quaternion of a Cartesian command is all zeros")

    def segments(self, command: Command, n_steps: int, simulation: Simulation) -> Iterator[Segment]:
        """The arm's solution with the gripper commands, held."""
        if np.isnan(command[0]):
            yield HOME, n_steps
            return
        pose = tuple(command[:7].tolist())
        if pose != self._pose:
            solution = simulation.robot.inverse_kinematics(pose[:3], pose[3:])
            self._pose, self._arm = pose, solution[:7]
        yield (*self._arm, *command[7:].tolist()), n_steps

    def reset(self) -> None:
        """Solve the next pose again."""
        self._pose = None


def _random_pose(boxes: Boxes, random: np.random.Generator) -> NDArray[np.float64]:
    pose = draw(boxes, "cartesian_command", random)
    quaternion = random.normal(size=4)  # uniform on the sphere once it has unit length
    pose[3:] = quaternion / np.linalg.norm(quaternion)
    return np.concatenate([pose, draw(boxes, "gripper_command", random)])
