"""The paper's analyses (section Results) as arrays: of what was played, seen, and scored.

Pure: arrays in, arrays and records out. Lengths are metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import RealBenchError
from real_bench.real_x.abstraction import DynamicAbstraction
from real_bench.real_x.triplets import Triplets
from real_bench.recording import MOVED_M
from real_bench.scoring.result import Result

Floats = NDArray[np.float64]

NEAR_M = (0.01, 0.20)
"""The range in which the paper looks at distances once more."""

ACTIONS_A_PERIOD = 500


@dataclass(frozen=True)
class PairDistances:
    """How far apart pairs of states are, in latent and in real space.

    Attributes:
        latent, real: of each pair, (n,); real ones in metres.
    """

    latent: Floats
    real: Floats

    def __post_init__(self) -> None:
        if self.latent.ndim != 1 or self.latent.shape != self.real.shape:
            raise RealBenchError(
                f"pairs need as many latent as real distances, not {self.latent.shape} and "
                f"{self.real.shape}"
            )

    def within(self, low: float, high: float) -> PairDistances:
        """The pairs whose real distance is between ``low`` and ``high`` metres."""
        near = (self.real > low) & (self.real < high)
        return PairDistances(self.latent[near], self.real[near])

    @property
    def spearman(self) -> float:
        """Spearman's rank correlation; NaN where one of the two never varies."""
        from scipy.stats import rankdata

        return _correlation(rankdata(self.latent), rankdata(self.real))

    @property
    def pearson(self) -> float:
        """Pearson's correlation; NaN where one of the two never varies."""
        return _correlation(self.latent, self.real)


def pair_distances(
    states: Floats, positions: Floats, n_pairs: int, random: np.random.Generator
) -> PairDistances:
    """Latent against real distance of pairs drawn at random (paper, figure of latent distances).

    Args:
        states: codes of n states, (n, V).
        positions: of the objects in them, (n, n_objects, 3) metres; the real distance of two
            states is that of all objects' coordinates together.
        n_pairs: how many pairs.
        random: where the draws come from.
    """
    if len(states) != len(positions) or len(states) < 2:
        raise RealBenchError(
            f"pairs are drawn from 2 states or more with their positions, not {len(states)} "
            f"and {len(positions)}"
        )
    first, second = random.integers(len(states), size=(2, n_pairs))
    flat = positions.reshape(len(positions), -1)
    return PairDistances(
        np.linalg.norm(states[first] - states[second], axis=1),
        np.linalg.norm(flat[first] - flat[second], axis=1),
    )


def action_lengths(displacements: Floats) -> Floats:
    """How far the actions that moved something moved it most, sorted, (k,) metres.

    Args:
        displacements: of each object by each action, (n, n_objects), as a recording tells them.
    """
    farthest = displacements.max(axis=1, initial=0.0)
    return np.asarray(np.sort(farthest[farthest > MOVED_M]), np.float64)


def effective_actions(triplets: Triplets, abstraction: DynamicAbstraction) -> NDArray[np.int64]:
    """How many actions are effective at each level, (L,) (paper, figure of effective actions)."""
    below = abstraction.effective_below(triplets.differences)
    levels = np.arange(abstraction.n_levels)
    return np.asarray((below[:, None] > levels).sum(axis=0), np.int64)


def moves_by_period(displacements: Floats, period: int = ACTIONS_A_PERIOD) -> NDArray[np.int64]:
    """How many actions of each period moved an object by more than 1 cm, (ceil(n / period),).

    Args:
        displacements: (n, n_objects) metres.
        period: actions that are counted together; the last ones may be fewer.
    """
    if period < 1:
        raise RealBenchError(f"a period has at least 1 action, not {period}")
    moved = displacements.max(axis=1, initial=0.0) > MOVED_M
    starts = np.arange(0, len(moved), period)
    return np.add.reduceat(moved, starts, dtype=np.int64) if len(moved) else np.zeros(0, np.int64)


def scores_by_goal(results: Sequence[Result]) -> tuple[tuple[str, ...], Floats]:
    """Class of each goal, and its mean score over results on the same goals, (n_goals,)."""
    kinds = {
        (result.setting.goals_sha256, tuple(trial.goal for trial in result.trials))
        for result in results
    }
    if len(kinds) != 1:
        raise RealBenchError("scores by goal need results of the same goals of one set")
    scores = [[trial.score for trial in result.trials] for result in results]
    classes = tuple(trial.challenge for trial in results[0].trials)
    return classes, np.asarray(np.mean(scores, axis=0), np.float64)


def score_by_length(results: Sequence[Result]) -> tuple[NDArray[np.int64], Floats]:
    """Lengths of play in steps, ascending, and the mean score after each, (k,) both."""
    lengths = np.array([result.setting.run_steps for result in results], np.int64)
    scores = np.array([result.score for result in results])
    each = np.unique(lengths)
    means = np.array([scores[lengths == length].mean() for length in each], np.float64)
    return each, means


def _correlation(a: Floats, b: Floats) -> float:
    if len(a) < 2 or np.ptp(a) == 0 or np.ptp(b) == 0:
        return float("nan")
    return float(np.corrcoef(a, b)[0, 1])
