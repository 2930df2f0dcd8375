"""The benchmark's metric (paper, section Metrics). Lengths in metres."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

DECAY = math.log(4) / 0.10
"""The constant c of the paper: 10 cm away from its goal an object still scores 0.25."""


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
