"""From what happened in trials to scores, their intervals, tables and verdicts.

Pure: it loads neither the simulation nor recordings.
"""

from real_bench.scoring.metric import (
    DECAY,
    METRICS,
    Metric,
    distances,
    goal_score,
    object_scores,
)
from real_bench.scoring.statistics import Interval, goals_interval, plays_interval
from real_bench.scoring.summary import ClassSummary, summarise

__all__ = [
    "DECAY",
    "METRICS",
    "ClassSummary",
    "Interval",
    "Metric",
    "distances",
    "goal_score",
    "goals_interval",
    "object_scores",
    "plays_interval",
    "summarise",
]
