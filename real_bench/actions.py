"""Actions, and how each way of control turns them into joint commands.

Two forms of the same thing: the official action dict, one a step (``macro_action``,
``joint_command``, ``cartesian_command`` + ``gripper_command``, and ``render``), and a whole
:class:`Action` that lasts many steps. Both come down to command vectors:

========= ==== ==================================================================
control   size command vector
========= ==== ==================================================================
joints    9    seven arm joints, gripper base, gripper tip (radians)
cartesian 9    x, y, z (metres), quaternion (x, y, z, w), gripper base and tip
macro     4    x1, y1, x2, y2 (metres): push from the first to the second point
========= ==== ==================================================================

A vector of NaN is the absence of a command (None): the robot goes to its home posture.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from real_bench.errors import ActionError
from real_bench.simulation import HOME, Segment, Simulation

Command = NDArray[np.float64]

ACTION_STEPS = 1000
"""How long an action of the paper's Explorer lasts, and a macro."""

LARGEST_NUMBER = 1e6
"""Metres or radians beyond this are no command of anybody's."""

LONGEST_STEPS = 1_000_000_000
"""No phase is longer; so the duration of an action is a sum that cannot overflow."""

VIA_POINT_STEPS = 850
"""Steps of a via-point action that follow the points; the rest is spent at home."""


@dataclass(frozen=True)
class Action:
    """A whole action: commands, each given for some steps.

    Attributes:
        commands: command vectors, (k, size) float64; a row of NaN is no command.
        n_steps: how long each is given, (k,) positive integers.
        line: whether the command moves on a straight line from the one before (home at first)
            to this one, (k,) bool; only joints can.
    """

    commands: NDArray[np.float64]
    n_steps: NDArray[np.int64]
    line: NDArray[np.bool_]

    def __post_init__(self) -> None:
        for name, kind in (("commands", np.float64), ("n_steps", np.int64), ("line", np.bool_)):
            object.__setattr__(self, name, _own(getattr(self, name), name, kind))
        if self.commands.ndim != 2 or len(self.commands) == 0:
            raise ActionError(
                f"an action needs commands of shape (k, size), not {self.commands.shape}"
            )
        k = len(self.commands)
        if self.n_steps.shape != (k,) or self.line.shape != (k,):
            raise ActionError(f"an action of {k} commands needs {k} durations and {k} line flags")
        if (self.n_steps < 1).any() or (self.n_steps > LONGEST_STEPS).any():
            raise ActionError(
                f"every command must last 1 to {LONGEST_STEPS:,} steps, "
                f"not {_short(self.n_steps.tolist())}"
            )
        numbers = self.commands[~np.isnan(self.commands)]
        if (np.abs(numbers) > LARGEST_NUMBER).any():
            raise ActionError(f"commands must be finite numbers, not {self.commands.tolist()}")

    @property
    def duration(self) -> int:
        """How many steps the action lasts."""
        return int(self.n_steps.sum())

    @classmethod
    def hold(cls, command: ArrayLike, n_steps: int) -> Action:
        """One command for some steps."""
        vector = _finite(_any_numbers(command, "a command").reshape(1, -1), "a command")
        return cls(vector, np.array([n_steps]), np.array([False]))

    @classmethod
    def macro(cls, points: ArrayLike) -> Action:
        """The macro-action: push along the table from one point to another, (2, 2) metres."""
        return cls.hold(np.reshape(_numbers(points, "macro points", 4), 4), ACTION_STEPS)

    @classmethod
    def via_points(cls, points: ArrayLike) -> Action:
        """Joints through via points, (n, 9) radians, from home and back (paper, REAL-LD).

        The home posture and the n points are joined by straight lines over 850 steps, point k
        reached at the floor of its evenly spaced step; then 150 steps of home.
        """
        vias = _finite(_any_numbers(points, "via points"), "via points")
        if vias.ndim != 2 or vias.shape[1] != 9 or len(vias) == 0:
            raise ActionError(f"via points must be of shape (n, 9), not {vias.shape}")
        reached = np.floor(np.linspace(0, VIA_POINT_STEPS, len(vias) + 1)).astype(np.int64)
        return cls(
            commands=np.vstack([vias, HOME]),
            n_steps=np.append(np.diff(reached), ACTION_STEPS - VIA_POINT_STEPS),
            line=np.append(np.ones(len(vias), bool), False),
        )

    @classmethod
    def poses(cls, commands: ArrayLike) -> Action:
        """Cartesian commands (n, 9), each for an equal part of 1000 steps."""
        vectors = _finite(_any_numbers(commands, "commands"), "commands")
        if vectors.ndim != 2:
            raise ActionError(f"commands must be of shape (n, size), not {vectors.shape}")
        ends = np.floor(np.linspace(0, ACTION_STEPS, len(vectors) + 1)).astype(np.int64)
        return cls(vectors, np.diff(ends), np.zeros(len(vectors), bool))

    @classmethod
    def rest(cls, size: int, n_steps: int = ACTION_STEPS) -> Action:
        """No command: go home and stay there. ``size`` is that of a command vector."""
        return cls(np.full((1, size), np.nan), np.array([n_steps]), np.array([False]))

    def commanded(self, moments: ArrayLike) -> NDArray[np.float64]:
        """What is commanded at some moments, (k, size).

        Args:
            moments: (k,) steps since the action began, 0 to its duration; of two commands that
                meet there, it is the earlier one.
        """
        at = np.clip(np.asarray(moments, np.float64), 0, self.duration)
        ends = np.cumsum(self.n_steps)
        row = np.searchsorted(ends, at)
        before = np.vstack([np.zeros(self.commands.shape[1]), self.commands[:-1]])[row]
        part = 1 - (ends[row] - at) / self.n_steps[row]
        part = np.where(self.line[row], part, 1.0)[:, None]
        return np.asarray(before + (self.commands[row] - before) * part, np.float64)

    def first(self, n_steps: int) -> Action:
        """The first steps of the action; the action itself where it is no longer than that."""
        if n_steps >= self.duration:
            return self
        starts = np.cumsum(self.n_steps) - self.n_steps
        kept = int((starts < n_steps).sum())
        durations = np.minimum(self.n_steps, n_steps - starts)[:kept]
        commands = self.commands[:kept].copy()
        if self.line[kept - 1]:  # a line that is cut ends on its way
            before = commands[kept - 2] if kept > 1 else np.zeros(commands.shape[1])
            part = durations[-1] / self.n_steps[kept - 1]
            commands[-1] = before + (commands[-1] - before) * part
        return Action(commands, durations, self.line[:kept].copy())


class Control(Protocol):
    """A way of control: reads action dicts, and turns commands into joint commands."""

    size: int

    @property
    def keys(self) -> tuple[str, ...]:
        """What an action dict must have, beside ``render``."""

    def command(self, action: Mapping[str, Any]) -> Command:
        """The command vector of an official action dict; raises ActionError for a bad one."""

    def segments(self, command: Command, n_steps: int, simulation: Simulation) -> Iterator[Segment]:
        """Joint commands for the next steps, made as they are needed."""

    def forget(self) -> None:
        """A new world has begun: forget what was commanded in the old one."""


class JointControl:
    """The nine joint commands themselves."""

    size = 9
    keys = ("joint_command",)

    def command(self, action: Mapping[str, Any]) -> Command:
        """The vector of ``{"joint_command": (9,) or None}``."""
        _check_keys(action, self.keys)
        return _vector(action["joint_command"], "joint_command", 9)

    def segments(self, command: Command, n_steps: int, simulation: Simulation) -> Iterator[Segment]:
        """The command, held."""
        yield (HOME if np.isnan(command[0]) else command.tolist()), n_steps

    def forget(self) -> None:
        """Nothing is remembered."""


class CartesianControl:
    """A pose of the gripper, by inverse kinematics, and the two gripper commands.

    The kinematics is solved anew only when the pose changes from one step to the next.
    """

    size = 9
    keys = ("cartesian_command", "gripper_command")

    def __init__(self) -> None:
        self._pose: tuple[float, ...] | None = None
        self._arm: tuple[float, ...] = ()

    def command(self, action: Mapping[str, Any]) -> Command:
        """The vector of ``{"cartesian_command": (7,), "gripper_command": (2,)}``, or of None."""
        _check_keys(action, self.keys)
        pose, gripper = action["cartesian_command"], action["gripper_command"]
        if pose is None:
            return np.full(9, np.nan)
        if gripper is None:
            raise ActionError("gripper_command is None beside a cartesian_command: give 2 numbers")
        vector = np.concatenate(
            [_vector(pose, "cartesian_command", 7), _vector(gripper, "gripper_command", 2)]
        )
        if not vector[3:7].any():
            raise ActionError("the quaternion of cartesian_command is all zeros")
        return vector

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

    def forget(self) -> None:
        """The next pose is solved anew."""
        self._pose = None


class MacroControl:
    """The macro-action: 1000 steps that push along a segment of the table and come back home.

    The whole trajectory is planned when a macro starts: one that differs from the last, or the
    same one after it has run out.
    """

    size = 4
    keys = ("macro_action",)

    def __init__(self) -> None:
        self._macro: tuple[float, ...] | None = None
        self._left: list[Segment] = []  # the last one comes next

    def command(self, action: Mapping[str, Any]) -> Command:
        """The vector of ``{"macro_action": (2, 2) or None}``."""
        _check_keys(action, self.keys)
        return _vector(action["macro_action"], "macro_action", 4)

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

    def forget(self) -> None:
        """The next macro is planned anew."""
        self._macro = None


def make_control(letter: str) -> MacroControl | JointControl | CartesianControl:
    """The control of a condition's second letter: M, J or C."""
    if letter == "M":
        return MacroControl()
    return JointControl() if letter == "J" else CartesianControl()


MACRO_EULER = (0.0, 3.14, -1.57)
MACRO_HIGH, MACRO_LOW = 0.6, 0.46
MACRO_PIECE = 0.05
MACRO_PUSH_STEPS = 500
MACRO_READY = (0.0, 0.0, 0.0, 0.0, 0.0, math.pi / 2, math.pi / 2, 0.0, 0.0)


def push_points(points: tuple[float, ...]) -> list[tuple[float, float]]:
    """The ends of the pieces in which a macro pushes; the last is its second point, to the bit.

    Args:
        points: x1, y1, x2, y2 in metres.
    """
    x1, y1, x2, y2 = points
    length = float(np.linalg.norm(np.array([x2 - x1, y2 - y1])))
    pieces = min(int(length / MACRO_PIECE) + 1, MACRO_PUSH_STEPS)
    parts = [k / pieces for k in range(1, pieces)]  # how they are computed decides the bits
    return [*((x1 + (x2 - x1) * part, y1 + (y2 - y1) * part) for part in parts), (x2, y2)]


def plan_macro(points: tuple[float, ...], simulation: Simulation) -> list[Segment]:
    """The 1000 steps of a macro, planned from the robot's present state.

    A change of its bits needs a new :data:`real_bench.conditions.CONTROL_VERSIONS`.
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


def action_segments(action: Action, control: Control, simulation: Simulation) -> Iterator[Segment]:
    """The joint commands of a whole action, made as they are needed."""
    before = np.zeros(control.size)
    for command, n_steps, line in zip(action.commands, action.n_steps, action.line, strict=True):
        if line:
            for step in range(1, int(n_steps)):
                on_the_way = before + (command - before) * (step / n_steps)
                yield from control.segments(on_the_way, 1, simulation)
        yield from control.segments(command, 1 if line else int(n_steps), simulation)
        before = command


def wants_render(action: Mapping[str, Any]) -> bool:
    """Whether an official action dict asks for camera images; raises ActionError."""
    try:
        return bool(np.any(action.get("render", False)))
    except Exception as error:  # a stranger's object may raise anything
        raise ActionError(f"render must be true or false, not {_short(action)}") from error


def check_action(action: object, control: Control) -> Action:
    """A copy of the action if it is one that ``control`` can execute; raises ActionError if not."""
    if type(action) is not Action:  # an object may claim any class, and a subclass do anything
        raise ActionError(f"an action was expected, not {_short(action)}")
    action = Action(action.commands, action.n_steps, action.line)  # frozen is not unchangeable
    if action.commands.shape[1] != control.size:
        raise ActionError(
            f"commands must be of shape (k, {control.size}), not {action.commands.shape}"
        )
    missing = np.isnan(action.commands)
    if (missing.any(axis=1) != missing.all(axis=1)).any() or np.isinf(action.commands).any():
        raise ActionError(f"commands must be finite numbers, not {action.commands.tolist()}")
    if action.line.any() and not isinstance(control, JointControl):
        raise ActionError("only joint commands can move on a straight line")
    return action


def check_command(command: NDArray[Any], control: Control) -> Command:
    """A command vector itself if ``control`` can execute it; raises ActionError if not."""
    if command.dtype != np.float64 or command.shape != (control.size,):
        raise ActionError(
            f"a command must be {control.size} numbers, not {command.dtype} {command.shape}"
        )
    if not np.abs(command).max() <= LARGEST_NUMBER and not np.isnan(command).all():
        raise ActionError(f"a command must be finite numbers, not {command.tolist()}")
    return command


def _check_keys(action: object, keys: tuple[str, ...]) -> None:
    wanted = " and ".join(repr(key) for key in keys)
    if not isinstance(action, Mapping):
        raise ActionError(f"an action dict with {wanted} was expected, not {_short(action)}")
    missing = [key for key in keys if key not in action]
    unknown = sorted(str(key) for key in set(action) - {*keys, "render"})
    if missing or unknown:
        found = ", ".join(sorted(map(str, action))) or "nothing"
        raise ActionError(f"an action needs the keys {wanted} (and 'render'), it has: {found}")


def _vector(value: object, what: str, size: int) -> Command:
    if value is None:
        return np.full(size, np.nan)
    return _finite(_numbers(value, what, size).reshape(-1), what)


def _finite(vector: NDArray[np.float64], what: str) -> NDArray[np.float64]:
    if not (np.abs(vector) <= LARGEST_NUMBER).all():
        raise ActionError(f"{what} must be finite numbers, not {vector.tolist()}")
    return vector


def _own(value: object, what: str, kind: type[Any]) -> NDArray[Any]:
    """A read-only copy of an action's array, as the kind of numbers that it must be."""
    try:
        given = np.array(value)
        if np.iscomplexobj(given):
            raise TypeError("complex numbers")
        with np.errstate(invalid="ignore"):  # NaN as a whole number is refused below
            array = given.astype(kind)
    except Exception as error:  # a stranger's object may raise anything
        raise ActionError(f"{what} must be numbers, not {_short(value)}") from error
    if kind is not np.float64 and not np.array_equal(given, array):
        raise ActionError(f"{what} must be whole numbers, not {_short(value)}")
    array.setflags(write=False)
    return array


def _numbers(value: object, what: str, size: int) -> NDArray[np.float64]:
    try:
        numbers = np.array(value, np.float64)
    except Exception as error:  # a stranger's object may raise anything
        raise ActionError(f"{what} must be {size} numbers, not {_short(value)}") from error
    if numbers.size != size:
        raise ActionError(f"{what} must be {size} numbers, not of shape {numbers.shape}")
    return numbers


def _any_numbers(value: object, what: str) -> NDArray[np.float64]:
    try:
        return np.array(value, np.float64)
    except Exception as error:  # a stranger's object may raise anything
        raise ActionError(f"{what} must be numbers, not {_short(value)}") from error


def _short(value: object) -> str:
    try:
        text = " ".join(f"{type(value).__name__} {value!r}".split())
    except Exception:  # a stranger's object may raise anything
        return type(value).__name__
    return text if len(text) < 80 else text[:77] + "..."
