"""What many scores say together. Pure: arrays in, records out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

CONFIDENCE = 0.95
RESAMPLES = 10_000
BOOTSTRAP_SEED = 0


@dataclass(frozen=True)
class Interval:
    """A confidence interval of a mean."""

    low: float
    high: float


def mean_interval(values: ArrayLike, seed: int = BOOTSTRAP_SEED) -> Interval | None:
    """The 95% percentile bootstrap interval of the mean; None for fewer than two values.

    The seed is part of the result: the same values always give the same interval.
    """
    from scipy.stats import bootstrap

    numbers = np.asarray(values, np.float64)
    if len(numbers) < 2:
        return None
    if (numbers == numbers[0]).all():  # nothing to resample
        return Interval(float(numbers[0]), float(numbers[0]))
    found = bootstrap(
        (numbers,),
        np.mean,
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=np.random.default_rng(seed),
    ).confidence_interval
    return Interval(float(found.low), float(found.high))
