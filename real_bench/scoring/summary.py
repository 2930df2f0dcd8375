"""The trials of one test, summarised by class of goal and in total (paper, section Metrics)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from real_bench.goal_sets.goal import CHALLENGES
from real_bench.scoring.metric import METRICS, Metric
from real_bench.scoring.statistics import Interval, goals_interval

if TYPE_CHECKING:
    from real_bench.scoring.result import Result, TrialResult

TOTAL = "total"


@dataclass(frozen=True)
class Mean:
    """The mean of a metric over goals.

    Attributes:
        value: None if a trial lacks the number.
        interval: over goals; None for a single goal.
    """

    value: float | None
    interval: Interval | None


@dataclass(frozen=True)
class ClassSummary:
    """Goals of one class, or all of them.

    Attributes:
        name: the class, or ``total``.
        n_goals: how many goals.
        means: by metric.
    """

    name: str
    n_goals: int
    means: dict[str, Mean]


def summarise(trials: Sequence[TrialResult]) -> list[ClassSummary]:
    """One summary per class that has goals, in the paper's order, and the total last."""
    by_class = [
        (name, [trial for trial in trials if trial.challenge == name]) for name in CHALLENGES
    ]
    groups = [*by_class, (TOTAL, list(trials))]
    return [
        ClassSummary(
            name, len(members), {key: _mean(each, members) for key, each in METRICS.items()}
        )
        for name, members in groups
        if members
    ]


def summary_json(result: Result) -> dict[str, Any]:
    """Every metric of a result, by class and by goal."""
    return {
        "complete": result.is_complete,
        "classes": [asdict(row) for row in summarise(result.trials)],
        "goals": [
            {
                "goal": trial.goal,
                "challenge": trial.challenge,
                **{name: metric.of(trial) for name, metric in METRICS.items()},
            }
            for trial in result.trials
        ],
    }


def _mean(metric: Metric, trials: Sequence[TrialResult]) -> Mean:
    values = [metric.number(trial) for trial in trials]
    mean = sum(values) / len(values)
    interval = goals_interval(values, [trial.challenge for trial in trials])
    return Mean(None if math.isnan(mean) else mean, interval)
