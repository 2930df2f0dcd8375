"""What many scores say together. Pure: arrays in, records out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

CONFIDENCE = 0.95
RESAMPLES = 10_000
BOOTSTRAP_SEED = 0

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Interval:
    """A confidence interval."""

    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.low:.3f} to {self.high:.3f}"


def mean_interval(values: ArrayLike, seed: int = BOOTSTRAP_SEED) -> Interval | None:
    """The 95% percentile bootstrap interval of the mean; None for fewer than two values.

    The seed is part of the result: the same values always give the same interval.
    """
    numbers = np.asarray(values, np.float64)
    return bootstrap_interval([numbers], np.mean, seed) if len(numbers) > 1 else None


def stratified_interval(
    scores: ArrayLike, seed: int = BOOTSTRAP_SEED, resamples: int = RESAMPLES
) -> Interval | None:
    """The 95% interval of the mean over repeats and goals, resampling the repeats of each goal.

    So it tells how far another set of repeats on the same goals would come. Resamples of n values
    vary less than samples of n by n - 1 over n, which for few repeats is much; deviations from each
    goal's mean are widened by as much beforehand (Rao and Wu 1988).

    Args:
        scores: (n_repeats, n_goals).
        seed: of the resampling, part of the result.
        resamples: how many.

    Returns:
        None for fewer than two repeats.
    """
    numbers = np.sort(np.asarray(scores, np.float64), axis=0)  # whichever repeat came first
    if len(numbers) < 2:
        return None
    means = numbers.mean(axis=0)
    widened = means + (numbers - means) * np.sqrt(len(numbers) / (len(numbers) - 1))
    return bootstrap_interval(list(widened.T), _mean_of_means, seed, resamples)


def stratified_mean_interval(
    values: ArrayLike, strata: Sequence[str], seed: int = BOOTSTRAP_SEED
) -> Interval | None:
    """The 95% interval of a mean over goals, resampling the goals of each class.

    Where a class has a single goal, which does not tell how its goals vary, all are one class.

    Args:
        values: (n_goals,).
        strata: class of each goal.
        seed: of the resampling, part of the result.

    Returns:
        None for fewer than two goals.
    """
    numbers, names = np.asarray(values, np.float64), np.asarray(strata)
    if len(numbers) < 2:
        return None
    groups = [numbers[names == name] for name in dict.fromkeys(strata)]
    if min(map(len, groups)) < 2:
        groups = [numbers]
    shares = np.array([len(group) for group in groups]) / len(numbers)

    def mean(*resampled: Floats, axis: int = -1) -> Any:
        parts = [
            share * part.mean(axis=axis) for share, part in zip(shares, resampled, strict=True)
        ]
        return np.sum(parts, axis=0)

    return bootstrap_interval(groups, mean, seed)


def standard_error(scores: ArrayLike) -> float | None:
    """The standard error of the mean over repeats, as the paper gives it; None for one repeat.

    Args:
        scores: (n_repeats, n_goals).
    """
    means = np.asarray(scores, np.float64).mean(axis=1)
    return float(means.std(ddof=1) / np.sqrt(len(means))) if len(means) > 1 else None


def interquartile_mean(scores: ArrayLike) -> float:
    """The mean of the middle half of all values: neither luck nor failure at the ends counts."""
    from scipy.stats import trim_mean

    return float(trim_mean(np.asarray(scores, np.float64), 0.25, axis=None))


def bootstrap_interval(
    samples: Sequence[Floats],
    statistic: Callable[..., Any],
    seed: int = BOOTSTRAP_SEED,
    resamples: int = RESAMPLES,
) -> Interval:
    """The 95% percentile bootstrap interval of a statistic of independent samples.

    Args:
        samples: each is resampled by itself.
        statistic: of all of them, along ``axis``.
        seed: of the resampling, part of the result.
        resamples: how many.
    """
    from scipy.stats import bootstrap

    if all((sample == sample[0]).all() for sample in samples):  # nothing to resample
        value = float(statistic(*samples, axis=-1))
        return Interval(value, value)
    found = bootstrap(
        # a sample of one is the same whichever is drawn, but scipy wants two
        [np.repeat(sample, 2) if len(sample) == 1 else sample for sample in samples],
        statistic,
        n_resamples=resamples,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=np.random.default_rng(seed),
        vectorized=True,
    ).confidence_interval
    return Interval(float(found.low), float(found.high))


def _mean_of_means(*samples: Floats, axis: int = -1) -> Any:
    return np.mean([sample.mean(axis=axis) for sample in samples], axis=0)
