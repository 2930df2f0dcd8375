"""The paper's analyses (section Results) of plays, latent codes and scores, as arrays.

Pure: arrays in, arrays and records out. Lengths are metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from real_bench.errors import RealBenchError
from real_bench.real_x.abstraction import DynamicAbstraction
from real_bench.real_x.triplets import Triplets
from real_bench.recording import MOVED_M
from real_bench.scoring.metric import SCORE
from real_bench.scoring.repeats import by_goal
from real_bench.scoring.result import Result

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]

NEAR_M = (0.01, 0.20)
"""The range of distances in which the paper takes a second look."""

ACTIONS_PER_PERIOD = 500

CELL_M = 0.025
MARGIN_CELLS = 4
"""How far coverage is counted beyond the given region."""


@dataclass(frozen=True, eq=False)
class PairDistances:
    """Distances of pairs of states in latent and in real space.

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
        """Spearman's rank correlation; NaN if one of the two never varies."""
        return _correlation(scipy.stats.rankdata(self.latent), scipy.stats.rankdata(self.real))

    @property
    def pearson(self) -> float:
        """Pearson's correlation; NaN if one of the two never varies."""
        return _correlation(self.latent, self.real)


def pair_distances(
    states: Floats, positions: Floats, n_pairs: int, random: np.random.Generator
) -> PairDistances:
    """Latent against real distance of pairs drawn at random (paper, figure of latent distances).

    Args:
        states: codes of n states, (n, V).
        positions: of the objects in them, (n, n_objects, 3) metres; the real distance of two
            states is over all objects' coordinates together.
        n_pairs: how many pairs.
        random: the generator for drawing.
    """
    if len(states) != len(positions) or len(states) < 2:
        raise RealBenchError(
            f"pairs need at least 2 states, and as many positions, not {len(states)} "
            f"and {len(positions)}"
        )
    first = random.integers(len(states), size=n_pairs)
    second = (first + random.integers(1, len(states), size=n_pairs)) % len(states)  # another one
    flat = positions.reshape(len(positions), -1)
    return PairDistances(
        np.linalg.norm(states[first] - states[second], axis=1),
        np.linalg.norm(flat[first] - flat[second], axis=1),
    )


def planar(
    positions: Floats, preconditions: NDArray[np.int64], outcomes: NDArray[np.int64]
) -> Triplets:
    """The triplets of REAL-D: x, y of each object before and after each action.

    Args:
        positions: of the objects in m states, (m, n_objects, 3) metres.
        preconditions: which states the n actions began in, (n,).
        outcomes: which they led to, (n,).
    """
    flat = positions[:, :, :2].reshape(len(positions), 2 * positions.shape[1])
    return Triplets(flat[preconditions], flat[outcomes])


def action_lengths(displacements: Floats) -> Floats:
    """The largest displacement by each action that moved something, sorted, (k,) metres.

    Args:
        displacements: of each object by each action, (n, n_objects), as a recording has them.
    """
    farthest = displacements.max(axis=1, initial=0.0)
    return np.asarray(np.sort(farthest[farthest > MOVED_M]), np.float64)


def effective_actions(triplets: Triplets, abstraction: DynamicAbstraction) -> NDArray[np.int64]:
    """How many actions are effective at each level, (L,) (paper, figure of effective actions)."""
    below = abstraction.effective_below(triplets.differences)
    levels = np.arange(abstraction.n_levels)
    return np.asarray((below[:, None] > levels).sum(axis=0), np.int64)


def levels_below(abstraction: DynamicAbstraction, length: float) -> NDArray[np.int64]:
    """The number of levels at which each variable's threshold is below a length, (V,)."""
    return np.asarray((abstraction.thresholds < length).sum(axis=0), np.int64)


def moves_by_period(displacements: Floats, period: int = ACTIONS_PER_PERIOD) -> Counts:
    """How many actions of each period moved an object by more than 1 cm, (ceil(n / period),).

    Args:
        displacements: (n, n_objects) metres.
        period: actions per period; the last one may be shorter.
    """
    return count_by_period(displacements > MOVED_M, period)


def count_by_period(happened: NDArray[np.bool_], period: int = ACTIONS_PER_PERIOD) -> Counts:
    """In how many actions of each period something happened to an object, (ceil(n / period),).

    Args:
        happened: to each object in each action, (n, n_objects).
        period: actions per period; the last one may be shorter.
    """
    if period < 1:
        raise RealBenchError(f"a period must have at least 1 action, not {period}")
    in_action = np.asarray(happened.any(axis=1))
    starts = np.arange(0, len(in_action), period)
    if not len(starts):
        return np.zeros(0, np.int64)
    return np.add.reduceat(in_action, starts, dtype=np.int64)


def scores_by_goal(results: Sequence[Result]) -> tuple[tuple[str, ...], Floats]:
    """Class of each goal, and its mean score over plays, (n_goals,); of results on the same goals.

    Raises:
        RealBenchError: their goals differ, or two are of the same test.
    """
    kinds = {
        (result.setting.goals_sha256, tuple(trial.goal for trial in result.trials))
        for result in results
    }
    if len(kinds) != 1:
        raise RealBenchError("scores by goal need results on the same goals of one set")
    table = by_goal(results)
    return table.classes, np.asarray(table.by_play(table.values(SCORE)).mean(axis=0), np.float64)


def score_by_length(results: Sequence[Result]) -> tuple[NDArray[np.int64], Floats]:
    """Lengths of play in steps, ascending, and the mean score after each, both (k,)."""
    groups: dict[int, list[Result]] = {}
    for result in results:
        groups.setdefault(result.setting.run_steps, []).append(result)
    each = sorted(groups)
    means = [scores_by_goal(groups[length])[1].mean() for length in each]
    return np.array(each, np.int64), np.array(means, np.float64)


@dataclass(frozen=True, eq=False)
class Coverage:
    """In how many states an object was in each cell of a grid over x and y.

    Attributes:
        counts: (n_x, n_y).
        x_edges, y_edges: of the cells, (n_x + 1,) and (n_y + 1,) metres, ascending.
    """

    counts: NDArray[np.int64]
    x_edges: Floats
    y_edges: Floats

    def share_visited(self, low: tuple[float, float], high: tuple[float, float]) -> float:
        """The share of visited cells among those centred in a region, x and y in metres."""
        centres = [(edges[1:] + edges[:-1]) / 2 for edges in (self.x_edges, self.y_edges)]
        inside = [
            (centre > a) & (centre < b) for centre, a, b in zip(centres, low, high, strict=True)
        ]
        return float((self.counts[np.ix_(*inside)] > 0).mean())


def coverage(positions: Floats, low: tuple[float, float], high: tuple[float, float]) -> Coverage:
    """Where an object has been; cells are counted from the region's low corner.

    Args:
        positions: in each state, (m, 2 or 3) metres; states beyond the grid are not counted.
        low: corner of the region, x and y in metres.
        high: its other corner; the grid reaches beyond both.
    """
    x_edges, y_edges = (_edges(start, end) for start, end in zip(low, high, strict=True))
    counts = np.histogram2d(positions[:, 0], positions[:, 1], (x_edges, y_edges))[0]
    return Coverage(counts.astype(np.int64), x_edges, y_edges)


def _edges(low: float, high: float) -> Floats:
    n_cells = round((high - low) / CELL_M)
    cells = np.arange(-MARGIN_CELLS, n_cells + MARGIN_CELLS + 1)
    return np.asarray(low + CELL_M * cells, np.float64)


def _correlation(a: Floats, b: Floats) -> float:
    if len(a) < 2 or np.ptp(a) == 0 or np.ptp(b) == 0:
        return float("nan")
    return float(np.corrcoef(a, b)[0, 1])
