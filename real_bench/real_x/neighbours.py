"""Which triplets can be started from a state, at one level of abstraction."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

FINEST = 1e-8
"""Smallest divisor of states, as a share of the largest state, to keep rounding small."""

ROUNDING = 1e-6


class Neighbours:
    """Finds states that count as the same as a given one.

    A k-d tree over states divided by their thresholds finds them within a cube of side 2, and a
    few more, which are then compared as they are.

    Args:
        states: (n, V).
        nodes: the rows of ``states`` that may be found, ascending.
        thresholds: of the level, (V,).
    """

    def __init__(
        self,
        states: NDArray[np.float64],
        nodes: NDArray[np.int64],
        thresholds: NDArray[np.float64],
    ) -> None:
        self._states, self._thresholds = states, thresholds
        # With a threshold of 0 no two states are the same, not even identical ones.
        self._nodes = nodes if (thresholds > 0).all() else nodes[:0]
        finest = FINEST * np.abs(states).max(initial=0.0)
        self._scale = np.maximum(thresholds, finest or 1.0)
        self._tree = scipy.spatial.KDTree(states[self._nodes] / self._scale)

    def find(self, state: NDArray[np.float64]) -> NDArray[np.int64]:
        """The nodes whose state is the same as a (V,) state, in any order."""
        near = self._tree.query_ball_point(state / self._scale, 1 + ROUNDING, p=np.inf)
        nodes = self._nodes[np.array(near, np.intp)]
        differences = np.abs(self._states[nodes] - state)
        return nodes[(differences < self._thresholds).all(axis=1)]
