"""From distances to the score table."""

from real_bench.scoring.metric import DECAY, distances, goal_score, object_scores
from real_bench.scoring.statistics import Interval, mean_interval
from real_bench.scoring.summary import ClassSummary, GoalOutcome, summarise

__all__ = [
    "DECAY",
    "ClassSummary",
    "GoalOutcome",
    "Interval",
    "distances",
    "goal_score",
    "mean_interval",
    "object_scores",
    "summarise",
]
