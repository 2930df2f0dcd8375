"""Actions before anything is known: random ones, and variations of those that did something."""

from __future__ import annotations

import numpy as np

from real_bench.real_g.arrays import Array
from real_bench.real_g.hand import Primitive
from real_bench.real_g.memory import sample_scales

REPEAT_SHARE = 0.5
"""The share of actions that vary the last one that moved something."""


class MotorBabbling:
    """Random actions, and variations of the last one that visibly moved something.

    The moved thing is not far from where it was, even if that place is still unknown.

    Args:
        primitive: the form of the actions.
    """

    def __init__(self, primitive: Primitive) -> None:
        self._primitive = primitive
        self._effective: Array | None = None

    def record_effective(self, parameters: Array) -> None:
        """An action with these parameters, (P,), moved something."""
        if not np.isnan(parameters).any():
            self._effective = parameters

    def next_parameters(self, random: np.random.Generator) -> Array:
        """Of the next action, (P,)."""
        low, high = self._primitive.low, self._primitive.high
        if self._effective is None or random.random() >= REPEAT_SHARE:
            return random.uniform(low, high)
        noise = random.normal(size=len(low)) * (high - low) * sample_scales(1, random)
        return np.asarray(np.clip(self._effective + noise, low, high))
