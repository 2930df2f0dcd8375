"""The score of an extrinsic phase, by class of goal and in total (paper, section Metrics)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from real_bench.goal_sets.goal import CHALLENGES
from real_bench.scoring.statistics import Interval, mean_interval

TOTAL = "total"


@dataclass(frozen=True)
class GoalOutcome:
    """How one trial ended.

    Attributes:
        challenge: class of the goal.
        score: M_g, in (0, number of objects].
        distances: of each object to its goal, metres.
    """

    challenge: str
    score: float
    distances: tuple[float, ...]


@dataclass(frozen=True)
class ClassSummary:
    """Goals of one class, or all of them.

    Attributes:
        name: the class, or ``total``.
        n_goals: how many goals.
        score: mean M_g.
        distance: mean distance of an object to its goal, metres.
        interval: 95% interval of the mean score; None for a single goal.
    """

    name: str
    n_goals: int
    score: float
    distance: float
    interval: Interval | None


def summarise(outcomes: Sequence[GoalOutcome]) -> list[ClassSummary]:
    """One summary a class that has goals, in the paper's order, and the total last."""
    by_class = [
        (name, [outcome for outcome in outcomes if outcome.challenge == name])
        for name in CHALLENGES
    ]
    groups = [*by_class, (TOTAL, list(outcomes))]
    return [_summary(name, members) for name, members in groups if members]


def _summary(name: str, outcomes: Sequence[GoalOutcome]) -> ClassSummary:
    scores = [outcome.score for outcome in outcomes]
    return ClassSummary(
        name=name,
        n_goals=len(outcomes),
        score=float(np.mean(scores)),
        distance=float(np.mean([outcome.distances for outcome in outcomes])),
        interval=mean_interval(scores),
    )
