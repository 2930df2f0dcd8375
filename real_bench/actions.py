"""Whole actions: command vectors (see :mod:`real_bench.controls`), each held for some steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from real_bench.errors import ActionError
from real_bench.inputs.numeric import MAX_MAGNITUDE, any_numbers, finite, numbers, short
from real_bench.simulation.posture import HOME

if TYPE_CHECKING:
    from real_bench.controls import Control
    from real_bench.simulation import Segment, Simulation

Command = NDArray[np.float64]

ACTION_STEPS = 1000
"""Length of an action of the paper's Explorer, and of a macro."""

MAX_ACTION_STEPS = 1_000_000_000
"""No phase is longer, so that the duration of an action cannot overflow."""

VIA_POINT_STEPS = 850
"""Steps of a via-point action that follow the points; the rest is spent at home."""


@dataclass(frozen=True, eq=False)
class Action:
    """A whole action: commands, each held for some steps.

    Attributes:
        commands: command vectors, (k, size) float64; a row of NaN is no command.
        n_steps: how long each is held, (k,) positive integers.
        line: whether the command moves on a straight line from the previous one (at first, home)
            to this one, (k,) bool; only joints can.
    """

    commands: NDArray[np.float64]
    n_steps: NDArray[np.int64]
    line: NDArray[np.bool_]

    def __post_init__(self) -> None:
        for name, kind in (("commands", np.float64), ("n_steps", np.int64), ("line", np.bool_)):
            object.__setattr__(self, name, _frozen_copy(getattr(self, name), name, kind))
        if self.commands.ndim != 2 or len(self.commands) == 0:
            raise ActionError(
                f"an action needs commands of shape (k, size), not {self.commands.shape}"
            )
        k = len(self.commands)
        if self.n_steps.shape != (k,) or self.line.shape != (k,):
            raise ActionError(f"an action of {k} commands needs {k} durations and {k} line flags")
        if (self.n_steps < 1).any() or (self.n_steps > MAX_ACTION_STEPS).any():
            raise ActionError(
                f"every command must last 1 to {MAX_ACTION_STEPS:,} steps, "
                f"not {short(self.n_steps.tolist())}"
            )
        given = self.commands[~np.isnan(self.commands)]
        if (np.abs(given) > MAX_MAGNITUDE).any():
            raise ActionError(f"commands must be finite numbers, not {self.commands.tolist()}")

    @property
    def duration(self) -> int:
        """How many steps the action lasts."""
        return int(self.n_steps.sum())

    @classmethod
    def hold(cls, command: ArrayLike, n_steps: int) -> Action:
        """One command for some steps."""
        vector = finite(any_numbers(command, "a command").reshape(1, -1), "a command")
        return cls(vector, np.array([n_steps]), np.array([False]))

    @classmethod
    def macro(cls, points: ArrayLike) -> Action:
        """The macro-action: push along the table from one point to another, (2, 2) metres."""
        return cls.hold(np.reshape(numbers(points, "macro points", 4), 4), ACTION_STEPS)

    @classmethod
    def via_points(cls, points: ArrayLike) -> Action:
        """Joints through via points, (n, 9) radians, from home and back (paper, REAL-LD).

        The home posture and the n points are joined by straight lines over 850 steps; point k is
        reached at its evenly spaced step, rounded down; then 150 steps at home.
        """
        vias = finite(any_numbers(points, "via points"), "via points")
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
        vectors = finite(any_numbers(commands, "commands"), "commands")
        if vectors.ndim != 2:
            raise ActionError(f"commands must be of shape (n, size), not {vectors.shape}")
        ends = np.floor(np.linspace(0, ACTION_STEPS, len(vectors) + 1)).astype(np.int64)
        return cls(vectors, np.diff(ends), np.zeros(len(vectors), bool))

    @classmethod
    def rest(cls, size: int, n_steps: int = ACTION_STEPS) -> Action:
        """No command: go home and stay there. ``size`` is the length of a command vector."""
        return cls(np.full((1, size), np.nan), np.array([n_steps]), np.array([False]))

    @classmethod
    def from_rows(cls, rows: NDArray[Any]) -> Action:
        """An action from rows as they are stored, with fields command, n_steps and line."""
        return cls(rows["command"], rows["n_steps"], rows["line"].astype(bool))

    def commanded(self, moments: ArrayLike) -> NDArray[np.float64]:
        """The commands at some moments, (k, size).

        Args:
            moments: (k,) steps since the action began, 0 to its duration; where two commands meet,
                the earlier one counts.
        """
        at = np.clip(np.asarray(moments, np.float64), 0, self.duration)
        ends = np.cumsum(self.n_steps)
        row = np.searchsorted(ends, at)
        before = np.vstack([np.zeros(self.commands.shape[1]), self.commands[:-1]])[row]
        part = 1 - (ends[row] - at) / self.n_steps[row]
        part = np.where(self.line[row], part, 1.0)[:, None]
        return np.asarray(before + (self.commands[row] - before) * part, np.float64)

    def first(self, n_steps: int) -> Action:
        """The first steps of the action; the action itself if it is no longer."""
        if n_steps >= self.duration:
            return self
        starts = np.cumsum(self.n_steps) - self.n_steps
        n_kept = int((starts < n_steps).sum())
        durations = np.minimum(self.n_steps, n_steps - starts)[:n_kept]
        commands = self.commands[:n_kept].copy()
        if self.line[n_kept - 1]:  # a truncated line ends midway
            before = commands[n_kept - 2] if n_kept > 1 else np.zeros(commands.shape[1])
            part = durations[-1] / self.n_steps[n_kept - 1]
            commands[-1] = before + (commands[-1] - before) * part
        return Action(commands, durations, self.line[:n_kept].copy())


def action_segments(action: Action, control: Control, simulation: Simulation) -> Iterator[Segment]:
    """The joint commands of a whole action, computed on demand."""
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
        raise ActionError(f"render must be true or false, not {short(action)}") from error


def check_action(action: object, control: Control) -> Action:
    """A copy of the action if it is one that ``control`` can execute; raises ActionError if not."""
    if type(action) is not Action:  # an object may claim any class, and a subclass do anything
        raise ActionError(
            f"an action was expected, not {short(action)}: with {control.name} return "
            f"{control.example}"
        )
    action = Action(
        action.commands, action.n_steps, action.line
    )  # frozen does not mean unchangeable
    if action.commands.shape[1] != control.size:
        raise ActionError(
            f"commands must be of shape (k, {control.size}), not {action.commands.shape}: with "
            f"{control.name} return {control.example}"
        )
    missing = np.isnan(action.commands)
    if (missing.any(axis=1) != missing.all(axis=1)).any() or np.isinf(action.commands).any():
        raise ActionError(f"commands must be finite numbers, not {action.commands.tolist()}")
    if action.line.any() and not control.draws_lines:
        raise ActionError("only joint commands can move on a straight line")
    control.check(action.commands)
    return action


def check_command(command: NDArray[Any], control: Control) -> Command:
    """A command vector itself if ``control`` can execute it; raises ActionError if not."""
    if command.dtype != np.float64 or command.shape != (control.size,):
        raise ActionError(
            f"a command must be {control.size} numbers, not {command.dtype} {command.shape}"
        )
    if not np.abs(command).max() <= MAX_MAGNITUDE and not np.isnan(command).all():
        raise ActionError(f"a command must be finite numbers, not {command.tolist()}")
    control.check(command[None])
    return command


def _frozen_copy(value: object, what: str, kind: type[Any]) -> NDArray[Any]:
    """A read-only copy of an action's array, with the required type of numbers."""
    try:
        given = np.array(value)
        if np.iscomplexobj(given):
            raise TypeError("complex numbers")
        with np.errstate(invalid="ignore"):  # NaN as a whole number is refused below
            array = given.astype(kind)
    except Exception as error:  # a stranger's object may raise anything
        raise ActionError(f"{what} must be numbers, not {short(value)}") from error
    if kind is not np.float64 and not np.array_equal(given, array):
        raise ActionError(f"{what} must be whole numbers, not {short(value)}")
    array.setflags(write=False)
    return array
