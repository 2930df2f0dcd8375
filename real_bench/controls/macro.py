"""The macro-action: x1, y1, x2, y2 (metres), a push from the first to the second point."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from real_bench.actions import Action, Command
from real_bench.controls.control import Boxes, Control, box, check_keys, draw, vector
from real_bench.simulation.posture import HOME

if TYPE_CHECKING:
    from gymnasium import spaces

    from real_bench.simulation import Segment, Simulation
    from real_bench.simulation.manifest import CommandLimits


class MacroControl(Control):
    """The macro-action: 1000 steps that push along a segment of the table and come back home.

    The whole trajectory is planned when a macro starts: when it differs from the last one, or when
    the same one has run out.
    """

    letter, name, official_name = "M", "macro-actions", "macro_action"
    version = 2  # macros end exactly at their second point
    size = 4
    keys = ("macro_action",)
    example = "Action.macro([[x1, y1], [x2, y2]])"

    @classmethod
    def boxes(cls, limits: CommandLimits) -> dict[str, spaces.Box]:
        """Two points on the table, (2, 2) metres."""
        return {
            "macro_action": box(np.array([limits.macro_low] * 2), np.array([limits.macro_high] * 2))
        }

    @classmethod
    def random_action(cls, boxes: Boxes, random: np.random.Generator) -> Action:
        """From one point to another."""
        return Action.macro(draw(boxes, "macro_action", random))

    def __init__(self) -> None:
        self._macro: tuple[float, ...] | None = None
        self._left: list[Segment] = []  # the last one comes next

    def command(self, action: Mapping[str, Any]) -> Command:
        """The vector of ``{"macro_action": (2, 2) or None}``."""
        check_keys(action, self.keys)
        return vector(action["macro_action"], "macro_action", 4)

    def segments(self, command: Command, n_steps: int, simulation: Simulation) -> Iterator[Segment]:
        """The next steps of the macro's trajectory."""
        if np.isnan(command[0]):
            yield HOME, n_steps
            return
        macro = tuple(command.tolist())
        if macro != self._macro:
            self._macro, self._left = macro, []
        while n_steps:
            if not self._left:
                self._left = plan_macro(macro, simulation)[::-1]
            joints, held = self._left.pop()
            if held > n_steps:
                self._left.append((joints, held - n_steps))
                held = n_steps
            n_steps -= held
            yield joints, held

    def reset(self) -> None:
        """Plan the next macro again."""
        self._macro = None


MACRO_EULER = (0.0, 3.14, -1.57)
MACRO_HIGH, MACRO_LOW = 0.6, 0.46
MACRO_PIECE = 0.05
MACRO_PUSH_STEPS = 500
MACRO_READY = (0.0, 0.0, 0.0, 0.0, 0.0, math.pi / 2, math.pi / 2, 0.0, 0.0)


def push_points(points: tuple[float, ...]) -> list[tuple[float, float]]:
    """The ends of the pieces of a macro's push; the last is exactly its second point.

    Args:
        points: x1, y1, x2, y2 in metres.
    """
    x1, y1, x2, y2 = points
    length = float(np.linalg.norm(np.array([x2 - x1, y2 - y1])))
    pieces = min(int(length / MACRO_PIECE) + 1, MACRO_PUSH_STEPS)
    parts = [k / pieces for k in range(1, pieces)]  # computed this way, since it decides the bits
    return [*((x1 + (x2 - x1) * part, y1 + (y2 - y1) * part) for part in parts), (x2, y2)]


def plan_macro(points: tuple[float, ...], simulation: Simulation) -> list[Segment]:
    """The 1000 steps of a macro, planned from the robot's present state.

    A change of its bits needs a new :attr:`MacroControl.version`.
    """
    from real_bench.simulation.bullet import pybullet

    quaternion = pybullet.getQuaternionFromEuler(MACRO_EULER)

    def reach(x: float, y: float, height: float) -> tuple[float, ...]:
        return simulation.robot.inverse_kinematics((x, y, height), quaternion)[:9]

    x1, y1, x2, y2 = points
    above_start, at_start = reach(x1, y1, MACRO_HIGH), reach(x1, y1, MACRO_LOW)
    above_end = reach(x2, y2, MACRO_HIGH)
    ends = [reach(x, y, MACRO_LOW) for x, y in push_points(points)]
    held = int(MACRO_PUSH_STEPS / len(ends))
    last = MACRO_PUSH_STEPS - held * (len(ends) - 1)
    return [
        (MACRO_READY, 100),
        (above_start, 100),
        (at_start, 50),
        *((end, held) for end in ends[:-1]),
        (ends[-1], last),
        (above_end, 50),
        (MACRO_READY, 100),
        (HOME, 100),
    ]
