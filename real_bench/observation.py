"""What a controller sees: computed when read, so that unread values cost nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NoReturn, SupportsIndex

from real_bench.errors import ControllerError
from real_bench.text.nearest import nearest

CAMERA_KEYS = frozenset({"retina", "depth", "mask"})
ONLY_IN_O = ("mask", "goal_mask", "object_positions", "object_orientations", "goal_positions")
GOAL_KEYS = frozenset({"goal", "goal_mask", "goal_positions"})


def missing_key(error: KeyError, keys: Sequence[str]) -> str:
    """What observations hold, for the message of a controller that asked for something like it.

    Args:
        error: what its code raised.
        keys: of observations in its condition.
    """
    key = error.args[0] if error.args else None
    if not isinstance(key, str) or key in keys:
        return ""
    if nearest(key, [*keys, *ONLY_IN_O]) is None:
        return ""
    more = "; only conditions with O have it" if key in ONLY_IN_O else ""
    return f" (an observation here has {', '.join(keys)}{more})"


class Observation(Mapping[str, Any]):
    """One moment, under the official keys.

    A value is computed when it is first read. Once the robot has moved on, unread values are gone:
    reading one raises ControllerError.

    Args:
        senses: how each value is computed.
        dark: the keys of images that the camera did not take; they are zeros.
        world: the number of its world; within one, nothing about the goal changes.
        has_goal: whether there is a goal; otherwise the goal's values are zeros.

    ``dark`` and ``world`` tell who sends it elsewhere what need not be sent.
    """

    def __init__(
        self,
        senses: Mapping[str, Callable[[], Any]],
        dark: frozenset[str] = frozenset(),
        world: int = 0,
        has_goal: bool = False,
    ) -> None:
        self.dark, self.world, self.has_goal = dark, world, has_goal
        self._senses = senses
        self._seen: dict[str, Any] = {}
        self._past = False

    def __getitem__(self, key: str) -> Any:
        if key not in self._seen:
            sense = self._senses[key]
            if self._past:
                raise ControllerError(
                    f"observation[{key!r}] was not read in time: read what you want to keep before "
                    "you return an action"
                )
            self._seen[key] = sense()
        return self._seen[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._senses)

    def __len__(self) -> int:
        return len(self._senses)

    def __reduce_ex__(self, protocol: SupportsIndex) -> NoReturn:
        """Refuse to be copied or pickled: it belongs to one world."""
        raise ControllerError(
            "an observation can be neither copied nor pickled: keep the values that you need, "
            "not the observation itself"
        )

    def expire(self) -> None:
        """The robot moves on: nothing more can be computed; values that were read stay."""
        self._past = True

    def now(self) -> dict[str, Any]:
        """Everything, read now, as a plain dict."""
        return {key: self[key] for key in self}
