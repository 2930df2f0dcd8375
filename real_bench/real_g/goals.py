"""Goals that the robot sets itself: where objects have been and a little beyond.

(Forestier et al., Intrinsically Motivated Goal Exploration Processes.)
"""

from __future__ import annotations

import math

import numpy as np
import scipy
from numpy.typing import NDArray

from real_bench.real_g.arrays import Array


class SelfGeneratedGoals:
    """Draws positions of the plane, most often where it is improving or has tried little.

    The plane is divided into cells. Each attempt at a cell is rated afterwards; a cell is drawn by
    how much its later attempts differ from its earlier ones, and by how few it had.

    Args:
        low, high: of x and y, (2,) each.
        cells: along each side.
        memory: how many of the latest attempts at a cell count.
        margin: how many cells beyond those where objects have been are drawn as well.
    """

    def __init__(
        self, low: Array, high: Array, cells: int = 8, memory: int = 20, margin: int = 2
    ) -> None:
        self._low, self._size = np.asarray(low), (np.asarray(high) - np.asarray(low)) / cells
        self._cells, self._memory, self._margin = cells, memory, margin
        self._visited = np.zeros((cells, cells), bool)
        self._attempts: dict[tuple[int, int], list[float]] = {}

    def observe(self, positions: Array) -> None:
        """Objects have been at (n, 2) positions."""
        for x, y in self._cell(positions):
            self._visited[x, y] = True

    def record_attempt(self, position: Array, success: float) -> None:
        """Rate an attempt at a position, (2,), from 0 to 1."""
        x, y = self._cell(np.asarray(position)[None])[0]
        history = self._attempts.setdefault((int(x), int(y)), [])
        history.append(success)
        del history[: -self._memory]

    def draw(self, random: np.random.Generator) -> Array:
        """A position, (2,); anywhere while no object has been seen."""
        around = np.ones((2 * self._margin + 1,) * 2, bool)
        reachable = (
            scipy.ndimage.binary_dilation(self._visited, around) if self._visited.any() else None
        )
        cells = np.argwhere(np.ones_like(self._visited) if reachable is None else reachable)
        interest = np.array([self.interest(int(x), int(y)) for x, y in cells])
        cell = cells[random.choice(len(cells), p=interest / interest.sum())]
        return np.asarray(self._low + (cell + random.random(2)) * self._size)

    def interest(self, x: int, y: int) -> float:
        """How much a cell is worth a try: progress, and novelty."""
        history = self._attempts.get((x, y), [])
        n = len(history)
        earlier, later = history[: n // 2], history[n // 2 :]
        progress = abs(float(np.mean(later)) - float(np.mean(earlier))) if n > 1 else 0.0
        return progress + 1 / math.sqrt(n + 1)

    def _cell(self, positions: Array) -> NDArray[np.int64]:
        cells = np.floor((np.asarray(positions) - self._low) / self._size).astype(np.int64)
        return np.clip(cells, 0, self._cells - 1)
