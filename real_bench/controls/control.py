"""The interface of a way of control."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action, Command
from real_bench.errors import ActionError
from real_bench.inputs.numeric import finite, numbers, short

if TYPE_CHECKING:
    from gymnasium import spaces

    from real_bench.simulation import Segment, Simulation
    from real_bench.simulation.manifest import CommandLimits

Boxes = Mapping[str, Any]
"""The boxes of an action space, by key."""

MAX_POINTS = 10
"""The most points of a random action (paper, section REAL-R)."""


class Control(ABC):
    """Reads official action dicts, and turns command vectors into joint commands.

    A command vector of NaN is the absence of a command (None): the robot goes to its home posture.

    Attributes:
        letter: in the names of conditions.
        name: in the plural, for messages.
        official_name: what the official package calls it (``action_type``).
        version: goes up when the same commands move the robot differently, even in the last bit.
        size: of a command vector.
        keys: of an official action dict, besides ``render``.
        example: how a controller makes an action, for messages.
        draws_lines: whether a command can move on a straight line from the one before.
    """

    letter: ClassVar[str]
    name: ClassVar[str]
    official_name: ClassVar[str]
    version: ClassVar[int] = 1
    size: ClassVar[int]
    keys: ClassVar[tuple[str, ...]]
    example: ClassVar[str]
    draws_lines: ClassVar[bool] = False

    @classmethod
    @abstractmethod
    def boxes(cls, limits: CommandLimits) -> dict[str, spaces.Box]:
        """What may be commanded, by key."""

    @classmethod
    @abstractmethod
    def random_action(cls, boxes: Boxes, random: np.random.Generator) -> Action:
        """An action of the Explorer in its basic version, 1000 steps (paper, section REAL-R)."""

    @classmethod
    def rest(cls) -> Action:
        """No command for 1000 steps: go home and stay there."""
        return Action.rest(cls.size)

    @classmethod
    def check(cls, commands: NDArray[np.float64]) -> None:
        """Raise ActionError if one of some command vectors, (k, size), cannot be executed."""
        return  # any can

    @abstractmethod
    def command(self, action: Mapping[str, Any]) -> Command:
        """The command vector of an official action dict; raises ActionError for a bad one."""

    @abstractmethod
    def segments(self, command: Command, n_steps: int, simulation: Simulation) -> Iterator[Segment]:
        """Joint commands for the next steps, made as they are needed."""

    def reset(self) -> None:  # noqa: B027  most have nothing to forget
        """A new world has begun: forget what was commanded in the old one."""


def box(low: NDArray[Any], high: NDArray[Any]) -> spaces.Box:
    """A box of float64."""
    from gymnasium import spaces

    return spaces.Box(low.astype(np.float64), high.astype(np.float64), dtype=np.float64)


def draw(boxes: Boxes, key: str, random: np.random.Generator) -> NDArray[np.float64]:
    """A uniform draw from the box of a key."""
    return np.asarray(random.uniform(boxes[key].low, boxes[key].high), np.float64)


def check_keys(action: object, keys: tuple[str, ...]) -> None:
    """Raise ActionError unless it is a dict with these keys, and perhaps ``render``."""
    wanted = " and ".join(repr(key) for key in keys)
    if not isinstance(action, Mapping):
        raise ActionError(f"an action dict with {wanted} was expected, not {short(action)}")
    missing = [key for key in keys if key not in action]
    unknown = sorted(str(key) for key in set(action) - {*keys, "render"})
    if missing or unknown:
        found = ", ".join(sorted(map(str, action))) or "nothing"
        raise ActionError(f"an action needs the keys {wanted} (and 'render'), it has: {found}")


def vector(value: object, what: str, size: int) -> Command:
    """A command of some numbers, all NaN for None; raises ActionError."""
    if value is None:
        return np.full(size, np.nan)
    return finite(numbers(value, what, size).reshape(-1), what)
