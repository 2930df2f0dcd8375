"""Several repeats of one test, summarised (paper, table of scores)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from real_bench.errors import ResultError
from real_bench.goal_sets.goal import CHALLENGES
from real_bench.scoring.metric import METRICS, SCORE, Metric
from real_bench.scoring.result import Result, TrialResult
from real_bench.scoring.statistics import (
    Floats,
    Interval,
    interquartile_mean,
    mean_interval,
    standard_error,
)

ENOUGH_PLAYS = 5
"""With fewer plays, a difference to another score says little."""


@dataclass(frozen=True)
class ByGoal:
    """Trials of several results on the same goals, goal by goal.

    Attributes:
        keys: of each goal: hash of its goal set, and its number in it.
        classes: of each goal.
        plays: of each repeat, what it learned from: hashes of recordings, or the seed if there
            was no play.
        trials: of each repeat, one per goal.
    """

    keys: tuple[tuple[str, int], ...]
    classes: tuple[str, ...]
    plays: tuple[str, ...]
    trials: tuple[tuple[TrialResult, ...], ...]

    def values(self, metric: str) -> Floats:
        """A metric, (n_repeats, n_goals); NaN where a trial lacks the number."""
        number = METRICS[metric].number
        return np.array([[number(trial) for trial in row] for row in self.trials])

    def by_play(self, values: Floats) -> Floats:
        """The mean over the repeats after the same play, (n_plays, n_goals)."""
        plays = np.array(self.plays)
        return np.array([values[plays == play].mean(axis=0) for play in dict.fromkeys(self.plays)])


@dataclass(frozen=True)
class MetricSummary:
    """A metric over several plays; one that was tested repeatedly counts once, by its mean.

    Attributes:
        mean: over plays and goals; this and the rest are NaN if a trial lacks the number.
        standard_error: of the mean over the plays; None for one.
        interval: see :func:`real_bench.scoring.statistics.mean_interval`.
        interquartile_mean: of the values of each play and goal.
        by_class: mean of each class that has goals, in the paper's order.
        by_repeat: mean of each repeat.
    """

    mean: float
    standard_error: float | None
    interval: Interval | None
    interquartile_mean: float
    by_class: dict[str, float]
    by_repeat: tuple[float, ...]


@dataclass(frozen=True)
class RepeatsSummary:
    """Several repeats on the same goals.

    Attributes:
        n_repeats, n_plays, n_goals: how many; one play may have been tested repeatedly.
        metrics: each by its name.
    """

    n_repeats: int
    n_plays: int
    n_goals: int
    metrics: dict[str, MetricSummary]

    @property
    def score(self) -> MetricSummary:
        """The benchmark's metric."""
        return self.metrics[SCORE]

    @property
    def is_enough(self) -> bool:
        """Whether there are enough plays to compare their mean with another."""
        return self.n_plays >= ENOUGH_PLAYS

    def to_json(self) -> dict[str, Any]:
        """Every number; None if there is none."""
        facts = asdict(self)
        for name, summary in self.metrics.items():
            if np.isnan(summary.mean):
                facts["metrics"][name] = None
        return facts


def by_goal(results: Sequence[Result]) -> ByGoal:
    """Trials of results; results on the same goal set are repeats.

    A repeat has one result on each set: those with the same seed of the test, or, where a seed
    occurs more than once, with the same recording, too.

    Raises:
        ResultError: there is none, or one of them twice or without a trial, or goal sets do not
            have results with the same seeds, or of the same goals.
    """
    if any(not each.trials for each in results):
        raise ResultError("a result has no trial yet: finish its test first")
    sets: dict[str, list[Result]] = {}
    tests = [
        (each.setting.goals_sha256, each.setting.seed, each.setting.run_sha256) for each in results
    ]
    if len(set(tests)) < len(tests):
        raise ResultError(
            "two results are of the same test: repeats need different seeds or recordings"
        )
    for result in sorted(results, key=lambda each: (each.setting.seed, each.setting.run_sha256)):
        sets.setdefault(result.setting.goals_sha256, []).append(result)
    if len({len(group) for group in sets.values()}) != 1:
        counts = ", ".join(f"{key[:8]}: {len(group)}" for key, group in sorted(sets.items()))
        raise ResultError(
            f"each goal set needs equally many results, not {counts or 'none at all'}"
        )
    groups = [group for _, group in sorted(sets.items())]
    _check_matched(groups)
    for group in groups:
        numbers = [[trial.goal for trial in result.trials] for result in group]
        if any(each != numbers[0] for each in numbers):
            goals = group[0].setting.goals_sha256[:8]
            raise ResultError(f"results on goal set {goals} did not test the same goals")
    firsts = [
        (group[0].setting.goals_sha256, trial) for group in groups for trial in group[0].trials
    ]
    repeats = list(zip(*groups, strict=True))
    return ByGoal(
        keys=tuple((goals, trial.goal) for goals, trial in firsts),
        classes=tuple(trial.challenge for _, trial in firsts),
        plays=tuple(" ".join(_play(result) for result in repeat) for repeat in repeats),
        trials=tuple(
            tuple(trial for result in repeat for trial in result.trials) for repeat in repeats
        ),
    )


def _check_matched(groups: Sequence[Sequence[Result]]) -> None:
    """Check that results in the same place of sorted groups are of the same repeat."""
    seeds = [[result.setting.seed for result in group] for group in groups]
    if any(each != seeds[0] for each in seeds):
        told = "; ".join(
            f"{group[0].setting.goals_sha256[:8]}: {', '.join(map(str, numbers))}"
            for group, numbers in zip(groups, seeds, strict=True)
        )
        raise ResultError(f"each goal set needs results with the same seeds, not {told}")
    runs = [[result.setting.run_sha256 for result in group] for group in groups]
    for seed, *repeat in zip(seeds[0], *runs, strict=True):
        if len(set(repeat)) > 1:
            raise ResultError(
                f"results with seed {seed} are after different recordings: a repeat is one play, "
                "tested on each goal set"
            )


def summarise_repeats(table: ByGoal) -> RepeatsSummary:
    """The summary of some repeats."""
    summaries = {}
    for name, metric in METRICS.items():
        values = table.values(name)
        by_play = table.by_play(values)
        summaries[name] = MetricSummary(
            mean=float(by_play.mean()),
            standard_error=standard_error(by_play),
            interval=mean_interval(by_play, table.classes, _highest(metric, table)),
            interquartile_mean=interquartile_mean(by_play),
            by_class=_by_class(by_play, table.classes),
            by_repeat=tuple(values.mean(axis=1).tolist()),
        )
    return RepeatsSummary(len(table.trials), len(by_play), len(table.keys), summaries)


def _highest(metric: Metric, table: ByGoal) -> float:
    """The largest value that there can be."""
    return math.inf if metric.highest is None else metric.highest(table.trials[0][0])


NO_PLAY = "seed "


def is_no_play(play: str) -> bool:
    """Whether there was no play, of one of :attr:`ByGoal.plays`."""
    return play.startswith(NO_PLAY)


def _play(result: Result) -> str:
    """What identifies the play that a result learned from."""
    setting = result.setting
    return setting.run_sha256 or f"{NO_PLAY}{setting.seed}"


def _by_class(values: ArrayLike, classes: Sequence[str]) -> dict[str, float]:
    numbers, names = np.asarray(values, np.float64), np.asarray(classes)
    return {name: float(numbers[:, names == name].mean()) for name in CHALLENGES if name in classes}
