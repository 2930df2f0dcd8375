"""How far from the camera the ground is, learned from depth images."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CELL = 4
"""Side of a cell of the ground, in pixels."""

FARTHEST = 0.99
"""Depth beyond which there is nothing to stand on: nearly as far as can be drawn."""


class Ground:
    """The farthest that was ever seen in each cell; what moves is only ever nearer.

    Depth images are not recorded, so this is what must be kept of them.
    """

    def __init__(self) -> None:
        self._depth = np.zeros((0, 0), np.float32)

    def add(self, depth: NDArray[np.floating[Any]]) -> None:
        """Learn from a depth buffer, (height, width) in 0..1."""
        cells = np.asarray(depth, np.float32)[CELL // 2 :: CELL, CELL // 2 :: CELL]
        same = self._depth.shape == cells.shape
        self._depth = np.maximum(self._depth, cells) if same else cells

    def distance(self, places: Array) -> Array:
        """How far the ground is at columns and rows, (..., 2) to (...).

        The unit is where the depth buffer begins; 1 everywhere while no depth has been seen.
        """
        if not self._depth.size:
            return np.ones(np.shape(places)[:-1])
        height, width = self._depth.shape
        cell = np.nan_to_num(np.asarray(places)).astype(np.intp) // CELL
        rows = np.clip(cell[..., 1], 0, height - 1)
        columns = np.clip(cell[..., 0], 0, width - 1)
        return 1 / (1 - np.minimum(self._depth[rows, columns], FARTHEST).astype(np.float64))

    def get_state(self) -> dict[str, Any]:
        """The cells."""
        return {"depth": self._depth}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with these cells."""
        self._depth = np.asarray(state["depth"], np.float32)
