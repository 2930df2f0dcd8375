"""Two sets of scores on the same goals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.conditions import CONTROLS, Condition
from real_bench.errors import ResultError
from real_bench.scoring.result import Result, Setting
from real_bench.scoring.statistics import Interval, stratified_mean_interval

ALIKE = ("objects", "scene_sha256", "trial_steps")
"""What must agree between any two results that are compared."""


@dataclass(frozen=True)
class GoalScores:
    """Some results' scores by goal.

    Attributes:
        keys: of each goal: hash of its goal set, and its number in it.
        classes: of each goal.
        scores: (n_repeats, n_goals).
    """

    keys: tuple[tuple[str, int], ...]
    classes: tuple[str, ...]
    scores: NDArray[np.float64]


@dataclass(frozen=True)
class GoalComparison:
    """One goal: its class, and both means."""

    goals_sha256: str
    goal: int
    challenge: str
    a: float
    b: float

    @property
    def difference(self) -> float:
        """A less B."""
        return self.a - self.b


@dataclass(frozen=True)
class Comparison:
    """A against B, goal by goal.

    Attributes:
        n_repeats: of A and of B.
        a, b: both means.
        interval: 95%, of the mean difference, resampling goals within their class: how far it would
            go on other goals such as these. None for one goal.
        improvement: the probability that A scores more than B on a goal, a tie counting half.
        improvement_interval: 95%, in the same way.
        goals: one by one.
    """

    n_repeats: tuple[int, int]
    a: float
    b: float
    interval: Interval | None
    improvement: float
    improvement_interval: Interval | None
    goals: tuple[GoalComparison, ...]

    @property
    def difference(self) -> float:
        """Mean of A less mean of B."""
        return self.a - self.b

    @property
    def is_worse(self) -> bool:
        """Whether A scores less than B, beyond chance."""
        return self.interval is not None and self.interval.high < 0

    def to_json(self) -> dict[str, Any]:
        """Every number."""
        goals = [{**asdict(goal), "difference": goal.difference} for goal in self.goals]
        return {**asdict(self), "difference": self.difference, "goals": goals}


def compare(a: Sequence[Result], b: Sequence[Result]) -> Comparison:
    """Compare two sets of results on the same goals; repeats are results on the same goal set.

    Raises:
        ResultError: they are not of the same scene, number of objects, length and goals.
    """
    _check_alike([*a, *b])
    ours, theirs = by_goal(a), by_goal(b)
    if ours.keys != theirs.keys:
        raise ResultError(
            f"A and B are not on the same goals: {len(ours.keys)} and {len(theirs.keys)}, of which "
            f"{len(set(ours.keys) & set(theirs.keys))} in common"
        )
    mean_a, mean_b = ours.scores.mean(axis=0), theirs.scores.mean(axis=0)
    chances = _chances(ours.scores, theirs.scores)
    return Comparison(
        n_repeats=(len(ours.scores), len(theirs.scores)),
        a=float(mean_a.mean()),
        b=float(mean_b.mean()),
        interval=stratified_mean_interval(mean_a - mean_b, ours.classes),
        improvement=float(chances.mean()),
        improvement_interval=stratified_mean_interval(chances, ours.classes),
        goals=tuple(
            GoalComparison(*key, challenge, float(one), float(other))
            for key, challenge, one, other in zip(
                ours.keys, ours.classes, mean_a, mean_b, strict=True
            )
        ),
    )


def by_goal(results: Sequence[Result]) -> GoalScores:
    """Scores of results, those on the same goal set as repeats.

    Raises:
        ResultError: there is none, or one of them twice, or goal sets do not have equally many
            results, or trials.
    """
    sets: dict[str, list[Result]] = {}
    tests = [
        (each.setting.goals_sha256, each.setting.seed, each.setting.run_sha256) for each in results
    ]
    if len(set(tests)) < len(tests):
        raise ResultError(
            "two results are of the same test: repeats are of other seeds, or other recordings"
        )
    for result in sorted(results, key=lambda each: each.setting.seed):
        sets.setdefault(result.setting.goals_sha256, []).append(result)
    if len({len(group) for group in sets.values()}) != 1:
        counts = ", ".join(f"{key[:8]}: {len(group)}" for key, group in sorted(sets.items()))
        raise ResultError(
            f"each goal set needs equally many results, not {counts or 'none at all'}"
        )
    keys: list[tuple[str, int]] = []
    classes: list[str] = []
    columns: list[list[float]] = []
    for goals, group in sorted(sets.items()):
        numbers = [[trial.goal for trial in result.trials] for result in group]
        if any(each != numbers[0] for each in numbers) or not numbers[0]:
            raise ResultError(f"results on goal set {goals[:8]} have not tested the same goals")
        keys += [(goals, number) for number in numbers[0]]
        classes += [trial.challenge for trial in group[0].trials]
        rows = [[trial.score for trial in result.trials] for result in group]
        columns += [list(column) for column in zip(*rows, strict=True)]
    return GoalScores(tuple(keys), tuple(classes), np.array(columns).T)


def _check_alike(results: Sequence[Result]) -> None:
    for name in ALIKE:
        values = {getattr(result.setting, name) for result in results}
        if len(values) > 1:
            told = ", ".join(sorted(str(value)[:12] for value in values))
            raise ResultError(f"results differ in {name.replace('_', ' ')}: {told}")
    check_one_control(result.setting for result in results)


def check_one_control(settings: Iterable[Setting]) -> None:
    """Raise ResultError where one way of control occurs in two versions."""
    versions: dict[str, int] = {}
    for setting in settings:
        control = Condition.parse(setting.condition).control
        first = versions.setdefault(control, setting.control_version)
        if setting.control_version != first:
            raise ResultError(
                f"results are of two versions of {CONTROLS[control]} "
                f"({first} and {setting.control_version}), in which the same commands move the "
                "robot a little differently: test again with this version"
            )


def _chances(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """For each goal, how often a repeat of A scores more than one of B, (n_goals,)."""
    difference = np.sign(a[:, None, :] - b[None, :, :])
    return np.asarray((difference.mean(axis=(0, 1)) + 1) / 2, np.float64)
