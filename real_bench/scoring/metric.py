"""The benchmark's metric (paper, section Metrics), and other numbers of a trial.

Lengths are metres.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from real_bench.scoring.result import TrialResult
    from real_bench.scoring.statistics import Interval

DECAY = math.log(4) / 0.10
"""The constant c of the paper: 10 cm away from its goal an object still scores 0.25."""

REACHED_M = 0.03
"""An object this close to its goal has reached it."""


def distances(positions: ArrayLike, goal_positions: ArrayLike) -> NDArray[np.float64]:
    """How far each object's centre is from its goal, (n_objects,), from (n_objects, 3) each."""
    return np.asarray(
        np.linalg.norm(np.asarray(positions) - np.asarray(goal_positions), axis=-1), np.float64
    )


def object_scores(distances: ArrayLike) -> NDArray[np.float64]:
    """exp(-c d) for each distance: 1 at the goal, in (0, 1]."""
    return np.asarray(np.exp(-DECAY * np.asarray(distances, np.float64)))


def goal_score(positions: ArrayLike, goal_positions: ArrayLike) -> float:
    """M_g: the objects' scores, summed."""
    return float(object_scores(distances(positions, goal_positions)).sum())


@dataclass(frozen=True)
class Metric:
    """One number of a trial; its means over goals are what tables show.

    Attributes:
        heading: of its column.
        of: the number, from what is kept of a trial; None if that is not enough.
        unit: of the number; empty if it has none.
        form: how it is printed.
        higher_is_better: whether more of it is better; None: neither is.
        highest: the largest that there can be of a trial; None: there is no such number.
        narrow: whether it has a column where room is short, as in an experiment's table.
    """

    heading: str
    of: Callable[[TrialResult], float | None]
    unit: str = ""
    form: str = ".3f"
    higher_is_better: bool | None = True
    highest: Callable[[TrialResult], int] | None = None
    narrow: bool = True

    @property
    def title(self) -> str:
        """The heading with the unit."""
        return f"{self.heading} ({self.unit})" if self.unit else self.heading

    def text(self, value: float | None) -> str:
        """A value as it is printed."""
        return "-" if value is None or math.isnan(value) else format(value, self.form)

    def text_of(self, trial: TrialResult) -> str:
        """The number of one trial as it is printed: whole, or yes and no, if it is."""
        value = self.of(trial)
        if isinstance(value, bool):
            return "yes" if value else "no"
        return str(value) if isinstance(value, int) else self.text(value)

    def change(self, value: float) -> str:
        """A difference as it is printed."""
        return format(value, f"+{self.form}")

    def interval(self, interval: Interval | None) -> str:
        """An interval as it is printed."""
        if interval is None:
            return "-"
        return f"{self.text(interval.low)} to {self.text(interval.high)}"

    def number(self, trial: TrialResult) -> float:
        """The number of a trial; NaN if there is none."""
        value = self.of(trial)
        return math.nan if value is None else float(value)


SCORE = "score"

METRICS: dict[str, Metric] = {
    SCORE: Metric("score", lambda trial: trial.score, highest=lambda trial: len(trial.distances)),
    "distance": Metric(
        "distance",
        lambda trial: sum(trial.distances) / len(trial.distances),
        unit="m",
        higher_is_better=False,
        narrow=False,
    ),
    "success": Metric(
        "within 3 cm",
        lambda trial: max(trial.distances) <= REACHED_M,
        form=".0%",
        highest=lambda _: 1,
        narrow=False,
    ),
    "actions": Metric(
        "actions",
        lambda trial: None if trial.commands is None else trial.commands.n_actions,
        form=".1f",
        higher_is_better=None,
        narrow=False,
    ),
}
"""By name, the benchmark's first. Every table, page and JSON shows these."""
