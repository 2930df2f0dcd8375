"""Statistics of many values. Pure: arrays in, records out."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

CONFIDENCE = 0.95
RESAMPLES = 10_000
BOOTSTRAP_SEED = 0

OVER_GOALS, OVER_PLAYS_AND_GOALS = "goals", "plays and goals"

MIN_PLAYS = 3
"""Two plays do not show how much plays differ: see ``python evaluation/intervals.py``."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Interval:
    """A 95% confidence interval of a mean.

    Attributes:
        low, high: its ends.
        over: what is resampled: ``goals``, or ``plays and goals``.
    """

    low: float
    high: float
    over: str

    def __str__(self) -> str:
        return f"{self.low:.3f} to {self.high:.3f}"


def interval_heading(over: str) -> str:
    """The heading of intervals."""
    return f"95% over {over}"


def goals_interval(
    values: ArrayLike, classes: Sequence[str], seed: int = BOOTSTRAP_SEED
) -> Interval | None:
    """The interval of the mean on other goals like these, after the same play.

    A percentile bootstrap of the goals within their class. If a class has a single goal, which
    cannot show how its goals vary, all are one class.

    Args:
        values: (n_goals,).
        classes: of each goal.
        seed: of the resampling, part of the result.

    Returns:
        None for fewer than two goals, or if a value is NaN.
    """
    numbers = np.asarray(values, np.float64)
    if len(numbers) < 2 or np.isnan(numbers).any():
        return None
    groups = [numbers[of_class] for of_class in _masks(classes)]
    shares = np.array([len(group) for group in groups]) / len(numbers)

    def mean(*resampled: Floats, axis: int = -1) -> Any:
        parts = [
            share * part.mean(axis=axis) for share, part in zip(shares, resampled, strict=True)
        ]
        return np.sum(parts, axis=0)

    return bootstrap_interval(groups, mean, seed)


def plays_interval(
    values: ArrayLike,
    classes: Sequence[str],
    min_plays: int = MIN_PLAYS,
    highest: float = math.inf,
) -> Interval | None:
    """The interval of the mean if everything were done again, with new plays and new goals.

    All plays meet the same goals, so the mean varies with plays, with goals (within their class)
    and with their interaction. The variances of the plays' means and of the goals' means both
    contain the interaction, so their sum counts it once too often; it is subtracted, but less of
    it the fewer plays there are, to allow for what few plays cannot show. The interval is
    Student's t with the degrees of freedom of the sum (Satterthwaite 1946).
    ``python evaluation/intervals.py`` prints how often it holds the truth.

    Args:
        values: (n_plays, n_goals).
        classes: of each goal.
        min_plays: with fewer there is no interval.
        highest: the largest that a value can be.

    Returns:
        None for too few plays, fewer than two goals, or if a value is NaN. It is not below 0
        unless a value is, and not above the highest.
    """
    numbers = np.asarray(values, np.float64)
    n_plays, n_goals = numbers.shape
    if n_plays < max(2, min_plays) or n_goals < 2 or np.isnan(numbers).any():
        return None
    found = _interval_over_both([numbers], classes)
    low = max(found.low, 0.0) if (numbers >= 0).all() else found.low
    return Interval(low, min(found.high, highest), OVER_PLAYS_AND_GOALS)


def difference_interval(
    a: ArrayLike, b: ArrayLike, classes: Sequence[str], *, same_plays: bool
) -> Interval | None:
    """The interval of the mean of A less the mean of B, on the same goals.

    As :func:`plays_interval`, of the differences play by play if both learned from the same plays;
    otherwise the plays of both vary, each on their own.

    Args:
        a: (n_plays, n_goals).
        b: the same, of as many plays as there are; of the same in the same order if ``same_plays``.
        classes: of each goal.
        same_plays: whether both learned from the same plays.

    Returns:
        Over goals alone if one side has fewer than three plays; None if there is none at all.
    """
    ours, theirs = np.asarray(a, np.float64), np.asarray(b, np.float64)
    if min(len(ours), len(theirs)) < MIN_PLAYS:
        return goals_interval(ours.mean(axis=0) - theirs.mean(axis=0), classes)
    if len(classes) < 2 or np.isnan(ours).any() or np.isnan(theirs).any():
        return None
    return _interval_over_both([ours - theirs] if same_plays else [ours, -theirs], classes)


def _interval_over_both(sides: Sequence[Floats], classes: Sequence[str]) -> Interval:
    """The interval of the sum of means over independent sets of plays on the same goals.

    Args:
        sides: (plays of the side, n_goals) each.
        classes: of each goal.
    """
    mean = float(sum(side.mean() for side in sides))
    play_parts = [
        (float(side.mean(axis=1).var(ddof=1)) / len(side), len(side) - 1) for side in sides
    ]
    goal_parts, together = _goal_parts(sides, classes)
    goal_variance = sum(part for part, _ in goal_parts)
    parts = play_parts + goal_parts
    whole = sum(part for part, _ in parts)
    if whole == 0:
        return Interval(mean, mean, OVER_PLAYS_AND_GOALS)
    # squares of tiny variances would be 0
    freedom = 1 / sum((part / whole) ** 2 / own for part, own in parts)
    twice = sum(
        part * (len(side) - 2) / (len(side) - 1) for part, side in zip(together, sides, strict=True)
    )
    half = float(
        scipy.stats.t.ppf((1 + CONFIDENCE) / 2, freedom)
        * np.sqrt(max(whole - twice, goal_variance))
    )
    return Interval(mean - half, mean + half, OVER_PLAYS_AND_GOALS)


def mean_interval(
    values: ArrayLike, classes: Sequence[str], highest: float = math.inf
) -> Interval | None:
    """The interval of a mean over plays and goals: over both if there are enough plays.

    Args:
        values: (n_plays, n_goals).
        classes: of each goal.
        highest: the largest that a value can be.

    Returns:
        Over goals alone for fewer than three plays; None if there is none at all.
    """
    numbers = np.asarray(values, np.float64)
    if len(numbers) < MIN_PLAYS:
        return goals_interval(numbers.mean(axis=0), classes)
    return plays_interval(numbers, classes, highest=highest)


def standard_error(values: ArrayLike) -> float | None:
    """The standard error of the mean over plays, as the paper gives it; None for one play.

    Args:
        values: (n_repeats, n_goals).
    """
    means = np.asarray(values, np.float64).mean(axis=1)
    return float(means.std(ddof=1) / np.sqrt(len(means))) if len(means) > 1 else None


def interquartile_mean(values: ArrayLike) -> float:
    """The mean of the middle half of all values: extremes do not count."""
    return float(scipy.stats.trim_mean(np.asarray(values, np.float64), 0.25, axis=None))


def bootstrap_interval(
    samples: Sequence[Floats],
    statistic: Callable[..., Any],
    seed: int = BOOTSTRAP_SEED,
    resamples: int = RESAMPLES,
) -> Interval:
    """The 95% percentile bootstrap interval of a statistic of independent samples of goals.

    Args:
        samples: each is resampled by itself.
        statistic: of all of them, along ``axis``.
        seed: of the resampling, part of the result.
        resamples: how many.
    """
    if all((sample == sample[0]).all() for sample in samples):  # nothing to resample
        value = float(statistic(*samples, axis=-1))
        return Interval(value, value, OVER_GOALS)
    found = scipy.stats.bootstrap(
        samples,
        statistic,
        n_resamples=resamples,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=np.random.default_rng(seed),
        vectorized=True,
    ).confidence_interval
    return Interval(float(found.low), float(found.high), OVER_GOALS)


def _masks(classes: Sequence[str]) -> list[NDArray[np.bool_]]:
    """Which goals are of each class; if one has a single goal, all are one class."""
    names = np.asarray(classes)
    masks = [names == name for name in dict.fromkeys(classes)]
    return masks if min(mask.sum() for mask in masks) > 1 else [np.ones(len(names), bool)]


def _goal_parts(
    sides: Sequence[Floats], classes: Sequence[str]
) -> tuple[list[tuple[float, int]], list[float]]:
    """What goals contribute to the variance of the sum of the sides' means.

    Returns:
        For each class its variance and degrees of freedom; and for each side the part of the
        variance that is due to the interaction of its plays with goals.
    """
    parts, together = [], [0.0] * len(sides)
    for group in _masks(classes):
        own = int(group.sum())
        weight = own / len(classes) ** 2
        means = np.sum([side[:, group].mean(axis=0) for side in sides], axis=0)
        parts.append((weight * float(means.var(ddof=1)), own - 1))
        for number, side in enumerate(sides):
            together[number] += weight * _interaction(side[:, group])
    return parts, together


def _interaction(values: Floats) -> float:
    """The variance of goals' means that their interaction with plays makes, (n_plays, n_goals)."""
    n_plays, own = values.shape
    rest = values - values.mean(axis=0) - values.mean(axis=1, keepdims=True) + values.mean()
    return float((rest**2).sum() / ((n_plays - 1) * (own - 1)) / n_plays)
