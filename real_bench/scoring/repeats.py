"""What several repeats of one test say together (paper, table of scores)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from real_bench.goal_sets.goal import CHALLENGES
from real_bench.scoring.statistics import (
    Interval,
    interquartile_mean,
    standard_error,
    stratified_interval,
)

ENOUGH_REPEATS = 5
"""With fewer, a difference to another score says little."""


@dataclass(frozen=True)
class RepeatsSummary:
    """Several repeats on the same goals.

    Attributes:
        n_repeats, n_goals: how many.
        mean: of all scores.
        standard_error: of the mean over the repeats; None for one.
        interval: 95%, see :func:`real_bench.scoring.statistics.stratified_interval`; no score is
            below 0, so it is not either.
        interquartile_mean: of all scores.
        by_class: mean of each class that has goals, in the paper's order.
        by_repeat: mean of each repeat.
    """

    n_repeats: int
    n_goals: int
    mean: float
    standard_error: float | None
    interval: Interval | None
    interquartile_mean: float
    by_class: dict[str, float]
    by_repeat: tuple[float, ...]

    @property
    def is_enough(self) -> bool:
        """Whether there are enough repeats to compare their mean with another."""
        return self.n_repeats >= ENOUGH_REPEATS


def summarise_repeats(scores: ArrayLike, classes: Sequence[str]) -> RepeatsSummary:
    """The summary of some scores.

    Args:
        scores: M_g, (n_repeats, n_goals), at least one of each.
        classes: of each goal.
    """
    numbers, names = np.asarray(scores, np.float64), np.asarray(classes)
    n_repeats, n_goals = numbers.shape
    interval = stratified_interval(numbers)
    return RepeatsSummary(
        n_repeats=n_repeats,
        n_goals=n_goals,
        mean=float(numbers.mean()),
        standard_error=standard_error(numbers),
        interval=None if interval is None else Interval(max(interval.low, 0.0), interval.high),
        interquartile_mean=interquartile_mean(numbers),
        by_class={
            name: float(numbers[:, names == name].mean()) for name in CHALLENGES if name in classes
        },
        by_repeat=tuple(numbers.mean(axis=1).tolist()),
    )
