"""Motion primitives: what the robot can do to an object with one action, and its parameters.

There are two forms with one interface: a hand that reaches, grips, carries and lets go (condition
C), and the paper's macro, a push (condition M). The form of an action is given to the robot; all
its parameters are free within the ranges that the action space declares.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from real_bench.actions import Action
from real_bench.errors import RealBenchError
from real_bench.real_g.arrays import Array


class Primitive(Protocol):
    """A form of action with P parameters, from one position to another.

    Attributes:
        low, high: the range of each parameter, (P,).
        start, end: which of them are x, y of the position where it begins and where it ends.
        goal: which of them a goal sets: where it ends, and how high it goes on the way, if it can.
        yaw: which of them is the hand's turn about the vertical, radians; None if it has none.
        height: which of them is the height at which it reaches an object; None if it has none.
        tilts: which of them are deviations from upright; 0 is upright.
        place_scale: when trials repeat actions of the play: how unlike two actions become with each
            metre between the places of their objects, in metres between where they begin relative
            to the object. It is larger where the same action turns out otherwise elsewhere. None:
            actions are not repeated, since hardly any two are alike; a model predicts outcomes.
        steps: how many steps it lasts.
    """

    low: Array
    high: Array
    start: tuple[int, int]
    end: tuple[int, int]
    goal: tuple[int, ...]
    yaw: int | None
    height: int | None
    tilts: tuple[int, ...]
    place_scale: float | None
    steps: int

    def action(self, parameters: Array) -> Action:
        """The action with these P parameters."""

    def parameters(self, action: Action) -> Array | None:
        """The P parameters of an action; None if it is not a whole action of this form."""

    def path(self, parameters: Array) -> Array:
        """Points that the hand passes near the objects, (k, 2) or with height (k, 3) metres."""

    def rest(self) -> Action:
        """No command, for the same time."""


class Push:
    """The paper's macro: x1, y1, x2, y2.

    Args:
        action_space: of a condition with macros; a dict of boxes.
    """

    start, end = (0, 1), (2, 3)
    goal: tuple[int, ...] = end
    yaw: int | None = None
    height: int | None = None
    tilts: tuple[int, ...] = ()
    place_scale: float | None = 0.05

    def __init__(self, action_space: Any) -> None:
        box = action_space.spaces["macro_action"]
        self.low, self.high = np.ravel(box.low), np.ravel(box.high)
        self.steps = self.rest().duration

    def action(self, parameters: Array) -> Action:
        """The macro from the first point to the second."""
        return Action.macro(parameters)

    def parameters(self, action: Action) -> Array | None:
        """The two points, (4,)."""
        is_one = len(action.commands) == 1 and action.duration == self.steps
        whole = is_one and not np.isnan(action.commands).any()
        return action.commands[0].copy() if whole else None

    def path(self, parameters: Array) -> Array:
        """The two points, (2, 2)."""
        return parameters.reshape(2, 2)

    def rest(self) -> Action:
        """No macro."""
        return Action.rest(4)


@dataclass(frozen=True)
class Stage:
    """A part of the hand's action: the number of poses, and the steps for which each is held."""

    poses: int
    steps: int


MIDDLE, ABOVE, DOWN, GRIP = Stage(1, 40), Stage(2, 50), Stage(1, 60), Stage(1, 55)
UP, CARRY, LOWER = Stage(3, 14), Stage(12, 15), Stage(4, 14)
LET_GO, LEAVE, HOME = Stage(1, 40), Stage(1, 30), Stage(1, 110)
STAGES = (MIDDLE, ABOVE, DOWN, GRIP, UP, CARRY, LOWER, LET_GO, LEAVE, HOME)
"""A distant pose makes the arm rush, so something in its grip is moved by many small ones. None is
longer than it has to be: a trial is as good as it has actions.
"""

MAX_TILT = np.pi / 4

ROUNDING = 1e-9


class Hand:
    """Reach, descend, grip, rise, carry along a line, lower, let go, leave, go home.

    Its parameters, in order: x1, y1, yaw, tilt, z1, two for the open gripper, two for closing it,
    rise, x2, y2, tilt, lower, two for opening it at the end. It rises by a share of the height
    above it, and lowers by a share of the height below. The fingers point down, turned about the
    vertical and tilted forward, away from the robot; it arrives via the middle of its space and
    leaves at the greatest allowed height.

    Args:
        action_space: of a condition with cartesian commands; a dict of boxes.
    """

    start, end = (0, 1), (10, 11)
    goal: tuple[int, ...] = (*end, 9)
    yaw: int | None = 2
    height: int | None = 4
    tilts: tuple[int, ...] = (3, 12)
    place_scale: float | None = None
    steps = sum(stage.poses * stage.steps for stage in STAGES)

    def __init__(self, action_space: Any) -> None:
        pose = action_space.spaces["cartesian_command"]
        grip = action_space.spaces["gripper_command"]
        self._middle = (np.asarray(pose.low[:3]) + np.asarray(pose.high[:3])) / 2
        self._bottom, self._top = float(pose.low[2]), float(pose.high[2])

        def assemble(p: Array, g: Array, yaw: float, tilt: float, share: float) -> Array:
            return np.array([*p[:2], yaw, tilt, p[2], *g, *g, share, *p[:2], tilt, share, *g])

        self.low = assemble(pose.low, grip.low, np.pi / 2, 0.0, 0.0)
        self.high = assemble(pose.high, grip.high, 3 * np.pi / 2, MAX_TILT, 1.0)

    def action(self, parameters: Array) -> Action:
        """The action of these 16 parameters; raises RealBenchError for another number of them."""
        if np.shape(parameters) != self.low.shape:
            raise RealBenchError(f"a hand's action has 16 numbers, not {np.shape(parameters)}")
        x1, y1, yaw, tilt1, z1, *first = (float(number) for number in parameters[:7])
        *closed, rise, x2, y2, tilt2, lower = (float(number) for number in parameters[7:14])
        last = [float(number) for number in parameters[14:]]
        top = self._top
        z2 = z1 + rise * (top - z1)
        z3 = z2 + lower * (self._bottom - z2)
        stops = [  # x, y, z, tilt, gripper
            (MIDDLE, (*self._middle[:2], top, tilt1, *first)),
            (ABOVE, (x1, y1, top, tilt1, *first)),
            (DOWN, (x1, y1, z1, tilt1, *first)),
            (GRIP, (x1, y1, z1, tilt1, *closed)),
            (UP, (x1, y1, z2, tilt1, *closed)),
            (CARRY, (x2, y2, z2, tilt2, *closed)),
            (LOWER, (x2, y2, z3, tilt2, *closed)),
            (LET_GO, (x2, y2, z3, tilt2, *last)),
            (LEAVE, (x2, y2, top, tilt2, *last)),
        ]
        rows, steps = [], []
        before = np.array(stops[0][1])
        for stage, stop in stops:
            after = np.array(stop)
            for part in np.arange(1, stage.poses + 1) / stage.poses:
                at = before + (after - before) * part
                at[4:] = after[4:]  # the gripper closes at once
                rows.append([*at[:3], *pointing_down(yaw, at[3]), *at[4:]])
                steps.append(stage.steps)
            before = after
        rows.append([np.nan] * 9)
        steps.append(HOME.steps)
        return Action(np.array(rows), np.array(steps), np.zeros(len(rows), bool))

    def parameters(self, action: Action) -> Array | None:
        """The 16 parameters, (16,); None for a rest or a truncated action."""
        ends = np.cumsum([stage.poses for stage in STAGES]) - 1
        if action.duration != self.steps or len(action.commands) != ends[-1] + 1:
            return None
        _, above, down, grip, up, carry, lower, let_go = action.commands[ends[:8]]
        yaw, tilt1 = yaw_and_tilt(above[3:7])
        _, tilt2 = yaw_and_tilt(carry[3:7])
        rise = _ratio(up[2] - down[2], self._top - down[2])
        lowered = _ratio(lower[2] - up[2], self._bottom - up[2])
        return np.array(
            [
                *(*above[:2], yaw, tilt1, down[2], *down[7:], *grip[7:]),
                *(rise, *carry[:2], tilt2, lowered, *let_go[7:]),
            ]
        )

    def path(self, parameters: Array) -> Array:
        """Where it grips, rises, arrives and lets go, (4, 3)."""
        (x1, y1), (x2, y2) = parameters[[0, 1]], parameters[[10, 11]]
        z1, rise, lower = parameters[[4, 9, 13]]
        z2 = z1 + rise * (self._top - z1)
        z3 = z2 + lower * (self._bottom - z2)
        return np.array([[x1, y1, z1], [x1, y1, z2], [x2, y2, z2], [x2, y2, z3]])

    def rest(self) -> Action:
        """No command: go home and stay there."""
        return Action.rest(9, self.steps)


def _ratio(part: float, whole: float) -> float:
    """A part as a share of the whole; 0 if the whole is 0."""
    return float(part / whole) if abs(whole) > ROUNDING else 0.0


def pointing_down(yaw: float, tilt: float) -> tuple[float, float, float, float]:
    """The quaternion of a hand that points down, turned about z, then tilted forward (about y)."""
    s, c = np.sin(yaw / 2), np.cos(yaw / 2)
    sl, cl = np.sin(-tilt / 2), np.cos(-tilt / 2)
    return (-s * cl, c * cl, s * sl, -c * sl)


def yaw_and_tilt(quaternion: Array) -> tuple[float, float]:
    """The arguments of :func:`pointing_down` for a quaternion, with the yaw in a full circle."""
    x, y, z, w = quaternion
    yaw = 2 * np.arctan2(-x, y)
    tilt = 2 * np.arctan2(np.hypot(z, w), np.hypot(x, y))
    return float(yaw % (2 * np.pi)), float(tilt)


def primitive_of(action_space: Any) -> Primitive:
    """The form of action that a condition allows; raises RealBenchError if there is none."""
    if "macro_action" in action_space.spaces:
        return Push(action_space)
    if "cartesian_command" in action_space.spaces:
        return Hand(action_space)
    raise RealBenchError("REAL-G acts with macros (M) and poses (C): with joints (J) use real_gj")
