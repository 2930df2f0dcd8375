"""Actions before anything is known: random ones, and variations of those that did something."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from real_bench.real_g.hand import Deed
from real_bench.real_g.memory import scale

Array = NDArray[np.float64]

AGAIN = 0.5
"""The share of actions that vary the last one that moved something."""


class Babble:
    """Random actions, and variations of the last one that visibly moved something.

    The moved thing is not far from where it was, even if that place is still unknown.

    Args:
        deed: the form of the actions.
    """

    def __init__(self, deed: Deed) -> None:
        self._deed = deed
        self._effective: Array | None = None

    def did(self, numbers: Array) -> None:
        """An action with these numbers, (P,), moved something."""
        if not np.isnan(numbers).any():
            self._effective = numbers

    def next_numbers(self, random: np.random.Generator) -> Array:
        """Of the next action, (P,)."""
        low, high = self._deed.low, self._deed.high
        if self._effective is None or random.random() >= AGAIN:
            return random.uniform(low, high)
        away = random.normal(size=len(low)) * (high - low) * scale(1, random)
        return np.asarray(np.clip(self._effective + away, low, high))
