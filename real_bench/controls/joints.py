"""Control by joints: seven of the arm, gripper base and tip (radians)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from real_bench.actions import Action, Command
from real_bench.controls.control import MAX_POINTS, Boxes, Control, box, check_keys, draw, vector
from real_bench.simulation.posture import HOME

if TYPE_CHECKING:
    from gymnasium import spaces

    from real_bench.simulation import Segment, Simulation
    from real_bench.simulation.manifest import CommandLimits


class JointControl(Control):
    """The nine joint commands themselves."""

    letter, name, official_name = "J", "joints", "joints"
    size = 9
    keys = ("joint_command",)
    example = "Action.via_points(points), with points of shape (n, 9)"
    draws_lines = True

    @classmethod
    def boxes(cls, limits: CommandLimits) -> dict[str, spaces.Box]:
        """The ranges of the joints, (9,) radians."""
        return {"joint_command": box(np.array(limits.command_low), np.array(limits.command_high))}

    @classmethod
    def random_action(cls, boxes: Boxes, random: np.random.Generator) -> Action:
        """Through 1 to 10 via points, and home again."""
        n_points = int(random.integers(1, MAX_POINTS, endpoint=True))
        return Action.via_points([draw(boxes, "joint_command", random) for _ in range(n_points)])

    def command(self, action: Mapping[str, Any]) -> Command:
        """The vector of ``{"joint_command": (9,) or None}``."""
        check_keys(action, self.keys)
        return vector(action["joint_command"], "joint_command", 9)

    def segments(self, command: Command, n_steps: int, simulation: Simulation) -> Iterator[Segment]:
        """The command, held."""
        yield (HOME if np.isnan(command[0]) else command.tolist()), n_steps
