"""Experience as plain arrays (paper, section REAL-X blueprint, Explorer)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import RealBenchError


@dataclass(frozen=True, eq=False)
class Triplets:
    """Preconditions s and outcomes s' of n actions; the row number says which action it was.

    Attributes:
        states: the preconditions, (n, V) finite numbers.
        outcomes: the outcomes, (n, V).
    """

    states: NDArray[np.float64]
    outcomes: NDArray[np.float64]

    def __post_init__(self) -> None:
        for name in ("states", "outcomes"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), np.float64))
        if self.states.ndim != 2 or self.states.shape != self.outcomes.shape:
            raise RealBenchError(
                "triplets need states and outcomes of one shape (n, V), not "
                f"{self.states.shape} and {self.outcomes.shape}"
            )
        numbers = np.hstack([self.states, self.outcomes])
        bad = np.flatnonzero(~np.isfinite(numbers).all(axis=1))
        if bad.size:
            raise RealBenchError(
                f"{bad.size} of {len(self)} triplets hold numbers that are not finite, "
                f"the first is triplet {bad[0]}"
            )

    def __len__(self) -> int:
        return len(self.states)

    @property
    def n_variables(self) -> int:
        """V, the number of state variables."""
        return int(self.states.shape[1])

    @property
    def differences(self) -> NDArray[np.float64]:
        """|s - s'| of each triplet, (n, V)."""
        return np.abs(self.states - self.outcomes)
