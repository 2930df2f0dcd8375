"""How far from the camera the ground is, learned from depth images."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from real_bench.real_g.arrays import Array

CELL = 4
"""Side of a cell of the ground, in pixels."""

MAX_DEPTH = 0.99
"""Depth beyond which there is nothing: nearly the far plane."""


class Ground:
    """The largest depth ever seen in each cell; things that move are always nearer.

    Depth images are not recorded, so this is kept instead.
    """

    def __init__(self) -> None:
        self._depth = np.zeros((0, 0), np.float32)
        self._filled: NDArray[np.float32] | None = None

    def add(self, depth: NDArray[np.floating[Any]]) -> None:
        """Learn from a depth buffer, (height, width) in 0..1."""
        cells = np.asarray(depth, np.float32)[CELL // 2 :: CELL, CELL // 2 :: CELL]
        same = self._depth.shape == cells.shape
        self._depth = np.maximum(self._depth, cells) if same else cells
        self._filled = None

    def distance(self, positions: Array) -> Array:
        """How far the ground is at columns and rows, (..., 2) to (...).

        A cell without ground takes the nearest cell's: things on an edge are seen beyond it. The
        unit is where the depth buffer begins; 1 while no depth has been seen.
        """
        if not self._depth.size:
            return np.ones(np.shape(positions)[:-1])
        depth = self._fill()
        height, width = depth.shape
        cell = np.nan_to_num(np.asarray(positions)).astype(np.intp) // CELL
        rows = np.clip(cell[..., 1], 0, height - 1)
        columns = np.clip(cell[..., 0], 0, width - 1)
        return 1 / (1 - depth[rows, columns].astype(np.float64))

    def _fill(self) -> NDArray[np.float32]:
        """The depth of the cells, filled in where there is nothing."""
        if self._filled is None:
            empty = self._depth > MAX_DEPTH
            if empty.all():
                empty[:] = False
            rows, columns = scipy.ndimage.distance_transform_edt(
                empty, return_distances=False, return_indices=True
            )
            self._filled = np.minimum(self._depth, MAX_DEPTH)[rows, columns]
        return self._filled

    def get_state(self) -> dict[str, Any]:
        """The cells."""
        return {"depth": self._depth}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with these cells."""
        self._depth = np.asarray(state["depth"], np.float32)
        self._filled = None
