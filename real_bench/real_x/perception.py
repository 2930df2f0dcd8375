"""How observations become the Planner's states."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
import scipy
from numpy.typing import NDArray
from PIL import Image

from real_bench.errors import RealBenchError
from real_bench.real_x.triplets import Triplets
from real_bench.recording import Experience

StateVector = NDArray[np.float64]

COPIES = 7
"""Copies of the states that making a planner takes at its peak, outcomes included."""

MAX_BYTES = 1_300_000_000
"""For these; with the planner's indices it all stays within 2 GB."""


class Perception(Protocol):
    """Turns observations into state vectors of V variables."""

    def state(self, observation: Mapping[str, Any]) -> StateVector:
        """The present state, (V,)."""

    def goal(self, observation: Mapping[str, Any]) -> StateVector:
        """The goal state, (V,)."""

    def triplets(self, experience: Experience) -> Triplets:
        """The experience as states."""

    def positions(self, states: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Objects' x, y in (k, V) states, (k, n_objects, 2) metres; None if not in the states."""

    def seed(self, seed: int) -> None:
        """Seed what it will learn."""

    def get_state(self) -> dict[str, Any]:
        """What it has learned, as plain values and arrays."""

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Use what was learned before."""


class _NothingLearned:
    """A perception that learns nothing."""

    def seed(self, seed: int) -> None:
        """Nothing is random."""

    def get_state(self) -> dict[str, Any]:
        """Nothing."""
        return {}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Nothing to restore."""


class ObjectPositions(_NothingLearned):
    """States are x and y of each object, metres (paper, condition REAL_OM)."""

    def state(self, observation: Mapping[str, Any]) -> StateVector:
        """x, y of each object now."""
        return _planar(observation["object_positions"])

    def goal(self, observation: Mapping[str, Any]) -> StateVector:
        """x, y of each object in the goal."""
        return _planar(observation["goal_positions"])

    def triplets(self, experience: Experience) -> Triplets:
        """x, y of each object before and after each action."""
        before, after = experience.positions_before(), experience.positions_after()
        n, size = len(experience), 2 * before.shape[1]
        return Triplets(before[:, :, :2].reshape(n, size), after[:, :, :2].reshape(n, size))

    def positions(self, states: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """The states, one row per object."""
        return states.reshape(len(states), states.shape[1] // 2, 2)


class BlurredImages(_NothingLearned):
    """States are the camera images themselves, blurred, grey and small.

    In a sharp image most actions leave most pixels exactly as they are, so at most levels their
    threshold is 0, at which nothing counts as the same: REAL-D finds no plan. In a blurred image
    every push affects every cell, as it does a coordinate. Nothing here is learned.

    Args:
        width, height: of the image, in cells.
        blur: standard deviation of the Gaussian, in cells; 0 for a sharp image.
    """

    def __init__(self, width: int, height: int, blur: float) -> None:
        self._width, self._height, self._blur = width, height, blur

    def state(self, observation: Mapping[str, Any]) -> StateVector:
        """The camera's image now."""
        return self._cells(observation["retina"])

    def goal(self, observation: Mapping[str, Any]) -> StateVector:
        """The image of the goal."""
        return self._cells(observation["goal"])

    def triplets(self, experience: Experience) -> Triplets:
        """The images before and after each action; raises RealBenchError if they are too many."""
        n_bytes = COPIES * len(experience) * self._width * self._height * 8
        if n_bytes > MAX_BYTES:
            raise RealBenchError(
                f"{len(experience):,} triplets of {self._width} x {self._height} cells would take "
                f"{n_bytes / 1e9:.1f} GB to plan with, more than {MAX_BYTES / 1e9:.1f}: "
                "set fewer cells"
            )
        if len(experience) == 0:
            return Triplets(*np.empty((2, 0, self._width * self._height)))
        states = experience.map_images(self._cells)
        return Triplets(states[experience.preconditions], states[experience.outcomes])

    def positions(self, states: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """None: images hold no positions."""
        return None

    def _cells(self, image: NDArray[np.uint8]) -> StateVector:
        grey = Image.fromarray(image).convert("F")
        small = grey.resize((self._width, self._height), Image.Resampling.BOX)
        cells = np.asarray(small, np.float64)
        if self._blur > 0:  # the kernel covers the image, so that every cell is affected
            reach = max(self._width, self._height)
            cells = scipy.ndimage.gaussian_filter(cells, self._blur, mode="nearest", radius=reach)
        return np.ravel(cells)


def _planar(positions: Mapping[str, Any]) -> StateVector:
    return np.concatenate([np.asarray(position)[:2] for position in positions.values()])
