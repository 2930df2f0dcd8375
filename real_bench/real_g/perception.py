"""Where objects are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from real_bench.actions import Action
from real_bench.real_g.arrays import Array
from real_bench.recording import Experience

PathOf = Callable[[Action], Array | None]
"""From an action to points that the hand passes, (k, 2) or with height (k, 3) metres; None where
it is not known."""


class Perception(Protocol):
    """Keeps what was seen during a play, and gives where objects were, are, and should be.

    An object's row is x, y, z in metres of what can be commanded, and its quaternion if known; NaN
    while it has not been seen. There may be no rows yet; the robot plays anyway.
    """

    def see(self, observation: Mapping[str, Any]) -> None:
        """The next moment of the play: before its first action, and after each."""

    def act(self, path: Array | None) -> None:
        """The hand will now pass these points."""

    def changed(self) -> bool:
        """Whether what was seen at the last moment differs from the moment before."""

    def recall(self, experience: Experience, path_of: PathOf) -> None:
        """Start over with a whole play."""

    def rows(self, first: int = 0) -> Array:
        """Rows of each object at each moment since the first, (k, n_objects, 3 or 7)."""

    def state(self, observation: Mapping[str, Any]) -> Array:
        """Rows of each object in an observation, (n_objects, 3 or 7)."""

    def goal(self, observation: Mapping[str, Any]) -> Array:
        """Where each object should be, (n_objects, 3)."""

    def seed(self, seed: int) -> None:
        """Seed what it will learn."""

    def get_state(self) -> dict[str, Any]:
        """All of it that is not in the recording, as plain values and arrays."""

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on from there."""


class PosePerception:
    """Positions and orientations as they are observed (conditions with O). Nothing is learned."""

    def __init__(self) -> None:
        self._rows: list[Array] = []

    def see(self, observation: Mapping[str, Any]) -> None:
        """Keep the rows of this moment."""
        self._rows.append(self.state(observation))

    def act(self, path: Array | None) -> None:
        """Ignored here."""

    def changed(self) -> bool:
        """Whether any object moved or turned."""
        return len(self._rows) > 1 and not np.array_equal(self._rows[-1], self._rows[-2])

    def recall(self, experience: Experience, path_of: PathOf) -> None:
        """Keep the rows of all states."""
        before = [experience.positions_before(), experience.orientations_before()]
        after = [experience.positions_after(), experience.orientations_after()]
        rows = np.full((experience.n_states, len(experience.object_names), 7), np.nan)
        rows[experience.preconditions] = np.concatenate(before, axis=2)
        rows[experience.outcomes] = np.concatenate(after, axis=2)
        self._rows = list(rows)

    def rows(self, first: int = 0) -> Array:
        """Rows of each object at each moment since the first, (k, n_objects, 7)."""
        return np.array(self._rows[first:])

    def state(self, observation: Mapping[str, Any]) -> Array:
        """Of each object now, (n_objects, 7)."""
        positions, orientations = (
            observation["object_positions"],
            observation["object_orientations"],
        )
        return np.array([[*positions[name], *orientations[name]] for name in positions])

    def goal(self, observation: Mapping[str, Any]) -> Array:
        """Where each object should be, (n_objects, 3)."""
        return np.array([*observation["goal_positions"].values()])

    def seed(self, seed: int) -> None:
        """Begin with an empty memory."""
        self._rows = []

    def get_state(self) -> dict[str, Any]:
        """Nothing: everything is in the recording."""
        return {}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Nothing to restore."""
