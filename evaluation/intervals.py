"""Print how often the 95% intervals hold the truth, by simulation with scores as skewed as ours.

python evaluation/intervals.py

A simulated test is on one goal set, or on four (results.md has two). Each goal has a mean of
its own, drawn anew for each test, and so has each play, whose mean is multiplied by a log-normal
number of the given spread; a trial's score is drawn around the product of both. Means and spreads
by class are those of our results (REAL-D in OM; REAL-R in IM), and so is what the last table
prints: how much plays differ, relative to the mean, beyond what goals and chance make of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from real_bench.experiments import read_spec
from real_bench.experiments.plan import ExperimentPlan
from real_bench.experiments.scores import rows_of
from real_bench.goal_sets import OFFICIAL_COUNTS
from real_bench.scoring.metric import SCORE
from real_bench.scoring.repeats import by_goal
from real_bench.scoring.result import load_result
from real_bench.scoring.statistics import (
    MIN_PLAYS,
    OVER_GOALS,
    OVER_PLAYS_AND_GOALS,
    Floats,
    difference_interval,
    goals_interval,
    interval_heading,
    plays_interval,
)

SPEC = Path(__file__).parent / "paper.yaml"
COUNTS = np.array(list(OFFICIAL_COUNTS.values()))
SETS = (1, 4)
PLAYS = (2, 3, 5, 10)
PLAYS_COMPARED = (3, 5, 10)
SPREADS = (0.0, 0.05, 0.1, 0.2)
MAX_SHARE = 0.98
MANY = 20_000


@dataclass(frozen=True)
class Scores:
    """How scores are drawn; one number a class each.

    Attributes:
        name: of the controller that scores so.
        means: of goals.
        goal_spreads: standard deviation of goals' means.
        concentrations: of the beta distribution around a trial's mean: the less, the more skewed.
    """

    name: str
    means: tuple[float, ...]
    goal_spreads: tuple[float, ...]
    concentrations: tuple[float, ...]

    def draw(
        self, shape: tuple[int, int], n_sets: int, spread: float, random: np.random.Generator
    ) -> Floats:
        """Scores of some tests and plays, (n_tests, n_plays, n_goals)."""
        means, spreads, around = (
            np.repeat(each, n_sets * COUNTS)
            for each in (self.means, self.goal_spreads, self.concentrations)
        )
        sharp = means * (1 - means) / spreads**2 - 1
        goals = random.beta(means * sharp, (1 - means) * sharp, (shape[0], 1, len(means)))
        plays = np.exp(random.normal(-(spread**2) / 2, spread, (*shape, 1)))
        share = np.clip(goals * plays, 1e-6, MAX_SHARE)
        scores: Floats = random.beta(share * around, (1 - share) * around)
        return scores


OURS = (
    Scores("REAL-D, OM", (0.46, 0.011, 0.007), (0.12, 0.01, 0.009), (2, 25, 30)),
    Scores("REAL-R, IM", (0.036, 0.010, 0.006), (0.032, 0.008, 0.006), (5, 100, 60)),
)


def coverage(scores: Scores, n_plays: int, n_sets: int, spread: float, n_tests: int) -> float:
    """How often the table's interval, for two plays, too, holds the mean of all tests."""
    random = np.random.default_rng(n_plays)
    truth = scores.draw((MANY, 1), 1, spread, random).mean()
    classes = np.repeat(list(OFFICIAL_COUNTS), n_sets * COUNTS).tolist()
    held = 0
    for values in scores.draw((n_tests, n_plays), n_sets, spread, random):
        found = plays_interval(values, classes, min_plays=2)
        held += found is not None and found.low <= truth <= found.high
    return held / n_tests


def coverage_of_a_difference(
    scores: Scores, n_plays: int, n_sets: int, spread: float, n_tests: int
) -> float:
    """How often the interval of the difference of two alike, of other plays, holds zero."""
    random = np.random.default_rng(100 + n_plays)
    classes = np.repeat(list(OFFICIAL_COUNTS), n_sets * COUNTS).tolist()
    held = 0
    for values in scores.draw((n_tests, 2 * n_plays), n_sets, spread, random):
        a, b = values[:n_plays], values[n_plays:]
        found = difference_interval(a, b, classes, same_plays=False)
        held += found is not None and found.low <= 0 <= found.high
    return held / n_tests


def coverage_of_one(scores: Scores, n_sets: int, n_tests: int) -> float:
    """How often the interval of one result holds the mean of all goals, after the same play."""
    random = np.random.default_rng(1)
    truth = scores.draw((MANY, 1), 1, 0.0, random).mean()
    classes = np.repeat(list(OFFICIAL_COUNTS), n_sets * COUNTS).tolist()
    held = 0
    for values in scores.draw((n_tests, 1), n_sets, 0.0, random):
        found = goals_interval(values[0], classes)
        held += found is not None and found.low <= truth <= found.high
    return held / n_tests


def play_spreads() -> Iterator[tuple[str, int, int, float]]:
    """Of cells with three repeats or more: name, plays, goals, and the spread of plays.

    The variance between plays' means less what goals and chance make of it, its root relative to
    the mean; negative where there is less variance than chance would make.
    """
    spec = read_spec(SPEC)
    for row in rows_of(spec, ExperimentPlan(spec)):
        if len(row.seeds) >= MIN_PLAYS:
            values = by_goal([load_result(file) for file in row.files]).values(SCORE)
            n_plays, n_goals = values.shape
            rest = values - values.mean(axis=0) - values.mean(axis=1, keepdims=True) + values.mean()
            chance = (rest**2).sum() / ((n_plays - 1) * (n_goals - 1)) / n_goals
            beyond = values.mean(axis=1).var(ddof=1) - chance
            relative = np.sign(beyond) * np.sqrt(abs(beyond)) / values.mean()
            yield row.cell.name, n_plays, n_goals, float(relative)


@click.command()
@click.option("--tests", default=2000, show_default=True, help="Simulated tests for each number.")
def main(tests: int) -> None:
    """Print how often the 95% intervals hold the truth."""
    console = Console(width=80)
    columns = ("scores of", "goals", "plays differ by", *(f"{n} plays" for n in PLAYS))
    held = Table(*columns, title=interval_heading(OVER_PLAYS_AND_GOALS))
    columns = ("scores of", "goals", "plays differ by", *(f"{n} plays" for n in PLAYS_COMPARED))
    differences = Table(*columns, title=f"{interval_heading(OVER_PLAYS_AND_GOALS)}, of A - B")
    alone = Table("scores of", "goals", "1 play", title=interval_heading(OVER_GOALS))
    for scores in OURS:
        for n_sets in SETS:
            goals = str(n_sets * COUNTS.sum())
            for spread in SPREADS:
                shares = (coverage(scores, n, n_sets, spread, tests) for n in PLAYS)
                held.add_row(scores.name, goals, f"{spread:.0%}", *(f"{s:.1%}" for s in shares))
                shares = (
                    coverage_of_a_difference(scores, n, n_sets, spread, tests)
                    for n in PLAYS_COMPARED
                )
                differences.add_row(
                    scores.name, goals, f"{spread:.0%}", *(f"{s:.1%}" for s in shares)
                )
            alone.add_row(scores.name, goals, f"{coverage_of_one(scores, n_sets, tests // 4):.1%}")
    console.print(held, f"With fewer than {MIN_PLAYS} plays the table shows none.")
    console.print(differences, alone)
    found = Table("cell", "plays", "goals", "plays differ by", title="our results")
    squares = []
    for name, n_plays, n_goals, spread in play_spreads():
        found.add_row(name, str(n_plays), str(n_goals), f"{spread:+.0%}")
        squares.append(spread * abs(spread))
    console.print(found, f"mean of the squares: {np.mean(squares):+.4f}, of {len(squares)} cells")


if __name__ == "__main__":
    main()
