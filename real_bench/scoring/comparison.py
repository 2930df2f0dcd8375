"""Two sets of results on the same goals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from real_bench.conditions import Condition
from real_bench.errors import ResultError
from real_bench.scoring.metric import METRICS, SCORE, Metric
from real_bench.scoring.one_test import check_one_test
from real_bench.scoring.repeats import ByGoal, by_goal, is_no_play
from real_bench.scoring.result import Result, Setting
from real_bench.scoring.statistics import (
    Floats,
    Interval,
    difference_interval,
    goals_interval,
    interval_heading,
)

COMMON_FIELDS = ("objects", "scene_sha256", "trial_steps")
"""What must agree between compared results."""


@dataclass(frozen=True)
class MetricComparison:
    """A against B in one metric.

    Attributes:
        a, b: both means over plays and goals; a play that was tested repeatedly counts once. These
            and the rest are NaN if a trial lacks the number.
        interval: of the mean difference; see
            :func:`real_bench.scoring.statistics.difference_interval`.
        improvement: the probability that A is better than B on a goal, a tie counting half; None
            where neither more nor less is better.
        improvement_interval: of that probability, over goals, after these plays.
    """

    a: float
    b: float
    interval: Interval | None
    improvement: float | None
    improvement_interval: Interval | None

    @property
    def difference(self) -> float:
        """Mean of A minus mean of B."""
        return self.a - self.b

    def to_json(self) -> dict[str, Any] | None:
        """Every number; None where there are none."""
        return (
            None if np.isnan(self.difference) else {**asdict(self), "difference": self.difference}
        )


@dataclass(frozen=True)
class GoalComparison:
    """One goal: its class, and both means of the score."""

    goals_sha256: str
    goal: int
    challenge: str
    a: float
    b: float

    @property
    def difference(self) -> float:
        """A minus B."""
        return self.a - self.b


@dataclass(frozen=True)
class Comparison:
    """A against B, goal by goal.

    Attributes:
        n_repeats: of A and of B.
        n_plays: of A and of B; one play may have been tested repeatedly.
        same_plays: whether both learned from the same plays; then they are compared play by play.
        metrics: each by its name.
        goals: one by one.
    """

    n_repeats: tuple[int, int]
    n_plays: tuple[int, int]
    same_plays: bool
    metrics: dict[str, MetricComparison]
    goals: tuple[GoalComparison, ...]

    def __repr__(self) -> str:
        score = self.score
        told = f"{score.a:.3f} - {score.b:.3f} = {score.difference:+.3f}"
        if score.interval is not None:
            told += f", {interval_heading(score.interval.over)} {score.interval}"
        return f"<Comparison of scores, A - B: {told}>"

    @property
    def score(self) -> MetricComparison:
        """The benchmark's metric."""
        return self.metrics[SCORE]

    @property
    def is_worse(self) -> bool:
        """Whether A scores less than B, beyond the chance that the interval is over."""
        return self.score.interval is not None and self.score.interval.high < 0

    def to_json(self) -> dict[str, Any]:
        """Every number."""
        goals = [{**asdict(goal), "difference": goal.difference} for goal in self.goals]
        metrics = {name: found.to_json() for name, found in self.metrics.items()}
        return {
            "n_repeats": self.n_repeats,
            "n_plays": self.n_plays,
            "same_plays": self.same_plays,
            "metrics": metrics,
            "goals": goals,
        }


def compare(a: Sequence[Result], b: Sequence[Result]) -> Comparison:
    """Compare two sets of results on the same goals; repeats are results on the same goal set.

    Raises:
        ResultError: scene, number of objects, length or goals differ, or one of them is not of one
            test.
    """
    check_one_test(a)
    check_one_test(b)
    _check_comparable([*a, *b])
    ours, theirs = by_goal(a), by_goal(b)
    if ours.keys != theirs.keys:
        raise ResultError(
            f"A and B are not on the same goals: {len(ours.keys)} and {len(theirs.keys)}, "
            f"{len(set(ours.keys) & set(theirs.keys))} of them in common"
        )
    plays = _plays_of(ours), _plays_of(theirs)
    same_plays = plays[0] == plays[1] and not any(map(is_no_play, plays[0]))
    metrics = {}
    for name, metric in METRICS.items():
        values = _by_sorted_play(ours, name), _by_sorted_play(theirs, name)
        metrics[name] = _compare_metric(metric, *values, ours.classes, same_plays=same_plays)
    means_a, means_b = (_by_sorted_play(each, SCORE).mean(axis=0) for each in (ours, theirs))
    return Comparison(
        n_repeats=(len(ours.trials), len(theirs.trials)),
        n_plays=(len(plays[0]), len(plays[1])),
        same_plays=same_plays,
        metrics=metrics,
        goals=tuple(
            GoalComparison(*key, challenge, float(one), float(other))
            for key, challenge, one, other in zip(
                ours.keys, ours.classes, means_a, means_b, strict=True
            )
        ),
    )


def _plays_of(table: ByGoal) -> list[str]:
    return sorted(set(table.plays))


def _by_sorted_play(table: ByGoal, metric: str) -> Floats:
    """The mean of a metric after each play, in the order of their names, (n_plays, n_goals)."""
    order = np.argsort(list(dict.fromkeys(table.plays)))
    return table.by_play(table.values(metric))[order]


def _compare_metric(
    metric: Metric, a: Floats, b: Floats, classes: Sequence[str], *, same_plays: bool
) -> MetricComparison:
    """Values of A and B, (n_plays, n_goals) each."""
    means = float(a.mean()), float(b.mean())
    interval = difference_interval(a, b, classes, same_plays=same_plays)
    if metric.higher_is_better is None:
        return MetricComparison(*means, interval, None, None)
    rates = _win_rates(a, b) if metric.higher_is_better else _win_rates(b, a)
    return MetricComparison(*means, interval, float(rates.mean()), goals_interval(rates, classes))


def check_baseline(
    baseline: Sequence[Result], planned: Mapping[str, Any], goals_sha256: str
) -> None:
    """Check before a test that its result can be compared with the baseline's.

    Args:
        baseline: results.
        planned: what the setting of the test will have of ``COMMON_FIELDS``, and its ``scene``.
        goals_sha256: hash of the goals that it will be on.

    Raises:
        ResultError: it cannot.
    """
    check_one_test(baseline)
    setting = baseline[0].setting
    for name in ("scene", *COMMON_FIELDS):
        found, wanted = getattr(setting, name), planned[name]
        if found != wanted:
            what = name.replace("_", " ")
            raise ResultError(f"the baseline has {what} {found}, the test {wanted}")
    if goals_sha256 not in {result.setting.goals_sha256 for result in baseline}:
        raise ResultError("the baseline is not on the goals of the test: give one that is")


def _check_comparable(results: Sequence[Result]) -> None:
    for name in COMMON_FIELDS:
        values = {getattr(result.setting, name) for result in results}
        if len(values) > 1:
            shown = ", ".join(sorted(str(value)[:12] for value in values))
            raise ResultError(f"results differ in {name.replace('_', ' ')}: {shown}")
    check_one_control(result.setting for result in results)


def check_one_control(settings: Iterable[Setting]) -> None:
    """Raise ResultError if one way of control occurs in two versions."""
    versions: dict[str, int] = {}
    for setting in settings:
        control = Condition.parse(setting.condition).control_type
        first = versions.setdefault(control.letter, setting.control_version)
        if setting.control_version != first:
            raise ResultError(
                f"results were made with two versions of {control.name} "
                f"({first} and {setting.control_version}), in which the same commands move the "
                "robot a little differently: test again with this version"
            )


def _win_rates(a: Floats, b: Floats) -> Floats:
    """For each goal, how often it goes better after a play of A than of B, (n_goals,)."""
    difference = np.sign(a[:, None, :] - b[None, :, :])
    return np.asarray((difference.mean(axis=(0, 1)) + 1) / 2, np.float64)
