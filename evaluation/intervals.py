"""Print how often the 95% interval holds the truth, and whether goals of one play share their luck.

python evaluation/intervals.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from real_bench.experiments import read_spec
from real_bench.experiments.agenda import Agenda
from real_bench.experiments.scores import rows_of
from real_bench.scoring.comparison import by_goal
from real_bench.scoring.result import load_result
from real_bench.scoring.statistics import Floats, bootstrap_interval, stratified_interval

SPEC = Path(__file__).parent / "paper.yaml"
SIMULATIONS, RESAMPLES, GOALS = 300, 1000, 50


def coverage(n_repeats: int) -> tuple[float, float]:
    """How often the interval holds the truth, widened as ours is and plain; skewed scores."""
    generator = np.random.default_rng(1)
    truth = generator.beta(0.5, 2, size=GOALS)
    held = np.zeros(2)
    for seed in range(SIMULATIONS):
        scores = truth + 0.15 * (generator.exponential(size=(n_repeats, GOALS)) - 1)
        ours = stratified_interval(scores, seed, RESAMPLES)
        plain = bootstrap_interval(list(scores.T), _mean, seed, RESAMPLES)
        assert ours is not None  # there are several repeats
        held += [each.low <= truth.mean() <= each.high for each in (ours, plain)]
    widened, unchanged = held / SIMULATIONS
    return float(widened), float(unchanged)


def f_ratio(scores: Floats) -> float:
    """Variance between the means of repeats, over that of goals and repeats: 1 by chance alone.

    Args:
        scores: (n_repeats, n_goals).
    """
    n_repeats, n_goals = scores.shape
    rest = scores - scores.mean(axis=0) - scores.mean(axis=1, keepdims=True) + scores.mean()
    within = (rest**2).sum() / ((n_repeats - 1) * (n_goals - 1))
    return float(n_goals * scores.mean(axis=1).var(ddof=1) / within)


def _mean(*samples: Floats, axis: int) -> Floats:
    return np.asarray(np.mean([sample.mean(axis=axis) for sample in samples], axis=0))


def main() -> None:
    """Print both."""
    held = Table("repeats", "widened", "plain", title="the 95% interval holds the truth")
    for n_repeats in (2, 3, 5, 10):
        held.add_row(str(n_repeats), *(f"{share:.1%}" for share in coverage(n_repeats)))
    shared = Table("cell", "repeats", "goals", "F", title="between repeats over within")
    ratios = []
    spec = read_spec(SPEC)
    for row in rows_of(spec, Agenda(spec)):
        if len(row.seeds) >= 3:
            scores = by_goal([load_result(file) for file in row.files]).scores
            ratios.append(f_ratio(scores))
            shared.add_row(row.cell.name, *map(str, scores.shape), f"{ratios[-1]:.2f}")
    Console(width=80).print(held, shared, f"mean of F: {np.mean(ratios):.2f}")


if __name__ == "__main__":
    main()
