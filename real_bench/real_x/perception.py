"""What the Planner's states are made of, before anything is learned about them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from real_bench.real_x.triplets import Triplets
from real_bench.recording import Experience

State = NDArray[np.float64]


class Perception(Protocol):
    """Turns what is seen into state vectors of V variables."""

    def state(self, observation: Mapping[str, Any]) -> State:
        """The present state, (V,)."""

    def goal(self, observation: Mapping[str, Any]) -> State:
        """The state that is asked for, (V,)."""

    def triplets(self, experience: Experience) -> Triplets:
        """What the robot went through, in states."""

    def positions(self, states: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Objects' x, y in (k, V) states, (k, n_objects, 2) metres, where these tell them."""


class ObjectPositions:
    """States are x and y of each object, metres (paper, condition REAL_OM)."""

    def state(self, observation: Mapping[str, Any]) -> State:
        """x, y of each object now."""
        return _planar(observation["object_positions"])

    def goal(self, observation: Mapping[str, Any]) -> State:
        """x, y of each object in the goal."""
        return _planar(observation["goal_positions"])

    def triplets(self, experience: Experience) -> Triplets:
        """x, y of each object before and after each action."""
        before, after = experience.positions_before(), experience.positions_after()
        n, size = len(experience), 2 * before.shape[1]
        return Triplets(before[:, :, :2].reshape(n, size), after[:, :, :2].reshape(n, size))

    def positions(self, states: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """The states, an object a row."""
        return states.reshape(len(states), states.shape[1] // 2, 2)


def _planar(positions: Mapping[str, Any]) -> State:
    return np.concatenate([np.asarray(position)[:2] for position in positions.values()])
