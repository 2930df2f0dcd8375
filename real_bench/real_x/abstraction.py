"""The Abstractor's Dynamic Abstraction (paper, section REAL-X blueprint, algorithm 2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from real_bench.errors import RealBenchError
from real_bench.real_x.triplets import Triplets

N_LEVELS = 200


@dataclass(frozen=True, eq=False)
class DynamicAbstraction:
    """The distance up to which two states count as the same, level by level.

    At level l two states are the same when they differ by less than ``thresholds[l, v]`` in every
    variable v. Levels are counted from 0, the finest; the paper counts them from 1.

    Attributes:
        thresholds: the L x V matrix, each column in ascending order, in the states' own units.
    """

    thresholds: NDArray[np.float64]

    def __post_init__(self) -> None:
        thresholds = np.asarray(self.thresholds, np.float64)
        object.__setattr__(self, "thresholds", thresholds)
        if thresholds.ndim != 2 or 0 in thresholds.shape:
            raise RealBenchError(f"thresholds must be levels x variables, not {thresholds.shape}")
        if not (np.isfinite(thresholds).all() and (thresholds >= 0).all()):
            raise RealBenchError("thresholds must be finite and not negative")
        if (np.diff(thresholds, axis=0) < 0).any():
            raise RealBenchError("thresholds must not fall from one level to the next")

    @classmethod
    def learn(cls, triplets: Triplets, n_levels: int = N_LEVELS) -> DynamicAbstraction:
        """The thresholds from experience: ranked differences, at equal intervals of rank.

        For each variable separately, |s - s'| of all triplets is sorted; level 0 takes the
        smallest, the last level the largest. Without triplets no two states are the same.
        """
        if n_levels < 2:
            raise RealBenchError(f"a dynamic abstraction needs at least 2 levels, not {n_levels}")
        if len(triplets) == 0:
            return cls(np.zeros((n_levels, triplets.n_variables)))
        ranked = np.sort(triplets.differences, axis=0)
        ranks = np.arange(n_levels) * len(triplets) // (n_levels - 1)
        return cls(ranked[np.minimum(ranks, len(triplets) - 1)])

    @classmethod
    def fixed(cls, thresholds: ArrayLike) -> DynamicAbstraction:
        """One level only, with (V,) thresholds chosen by hand: REAL-T."""
        return cls(np.asarray(thresholds, np.float64).reshape(1, -1))

    @property
    def n_levels(self) -> int:
        """L, the number of levels."""
        return len(self.thresholds)

    @property
    def n_variables(self) -> int:
        """V, the number of state variables."""
        return int(self.thresholds.shape[1])

    def first_same_level(self, differences: NDArray[np.float64]) -> NDArray[np.int64]:
        """The first level at which states count as the same, given their differences.

        Args:
            differences: |s1 - s2| of n pairs, (n, V).

        Returns:
            The lowest level for each pair, (n,); L if they differ at every level.
        """
        return self._rank(differences, "right")

    def effective_below(self, differences: NDArray[np.float64]) -> NDArray[np.int64]:
        """The level below which actions are effective, given |s - s'| of each, (n, V) to (n,).

        An action is effective at a level if its start and outcome differ by more than the
        threshold in any variable (paper, section Results).
        """
        return self._rank(differences, "left")

    def _rank(self, differences: NDArray[np.float64], side: str) -> NDArray[np.int64]:
        """How many levels are below, or not above, the differences; the most of any variable."""
        ranks = [
            np.searchsorted(column, values, side=side)  # type: ignore[call-overload]
            for column, values in zip(self.thresholds.T, np.abs(differences).T, strict=True)
        ]
        return np.asarray(np.max(ranks, axis=0), np.int64)
