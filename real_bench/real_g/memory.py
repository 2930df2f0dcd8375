"""Actions that went well, told from the object, so that they serve wherever it is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from real_bench.real_g.relation import Relation, turned

Array = NDArray[np.float64]

FARTHEST, NEAREST = 0.5, 0.005
"""Variation in shares of a number's range: drawn between these, each order as often."""


SITUATION = 5


class DeedMemory:
    """The best of what was done to an object, by the success of neighbours in action space.

    A single lucky outcome says little; so the success of each action is smoothed over the actions
    most like it. And what is easy at one place is hard at another; so kept is what went better
    than most of what was done in a like situation: from where, to where.

    Args:
        relation: of actions to objects.
        size: the most actions that are kept for reuse.
        share: of all actions that are kept, at most.
        neighbours: over how many success is smoothed.
        situations: with how many in a like situation each is compared.
        rivals: so many remembered actions are drawn, of which that of the most like situation is
            varied.
    """

    def __init__(
        self,
        relation: Relation,
        size: int = 400,
        share: float = 0.1,
        neighbours: int = 8,
        situations: int = 40,
        rivals: int = 4,
    ) -> None:
        self._relation, self._neighbours = relation, neighbours
        self._size, self._share = size, share
        self._situations, self._rivals = situations, rivals
        self._where = np.empty((0, SITUATION))
        self._unit = np.ones(SITUATION)
        deed = relation.deed
        self._range = deed.high - deed.low
        self.kept = np.empty((0, len(deed.low)))

    def learn(self, rows: Array, numbers: Array, success: Array) -> None:
        """Keep the best of n actions, with the object's rows (n, 3 or 7) before each."""
        told = self._relation.told(rows, numbers)
        points = told / self._range
        points[:, self._relation.deed.end] = 0  # where it goes is another matter
        k = min(self._neighbours, len(points))
        away, near = cKDTree(points).query(points, k)
        away = np.reshape(away, (len(points), k))
        near = np.reshape(near, (len(points), k))
        width = np.maximum(away[:, -1:] / 2, np.finfo(float).tiny)
        weights = np.exp(-((away / width) ** 2) / 2)
        smoothed = (weights * success[near]).sum(axis=1) / weights.sum(axis=1)
        n_kept = min(self._size, max(k, int(self._share * len(points))))
        where = self._situation(rows, numbers[:, self._relation.deed.end])
        spread = where.std(axis=0)
        self._unit = np.where(spread > 0, spread, 1.0)
        alike = min(self._situations, len(points))
        _, others = cKDTree(where / self._unit).query(where / self._unit, alike)
        others = np.reshape(others, (len(points), alike))
        rank = (smoothed[others] < smoothed[:, None]).mean(axis=1)
        best = np.lexsort([-smoothed, -rank])[:n_kept]
        self.kept, self._where = told[best], where[best]

    def get_state(self) -> dict[str, Any]:
        """What is kept."""
        return {"kept": self.kept, "where": self._where, "unit": self._unit}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with what is kept."""
        self.kept = np.asarray(state["kept"], np.float64)
        self._where = np.asarray(state["where"], np.float64)
        self._unit = np.asarray(state["unit"], np.float64)

    def _situation(self, rows: Array, ends: Array) -> Array:
        """Where objects are and where the hand is to end, (n, SITUATION)."""
        return np.concatenate([rows[:, :3], ends], axis=1)

    def varied(self, row: Array, ends: Array, random: np.random.Generator) -> Array:
        """Remembered actions, varied, at an object's row, to (n, 2) ends; (n, P) numbers.

        Each number of each is varied or not; how far, is drawn anew for each action.
        """
        deed, n = self._relation.deed, len(ends)
        drawn_of = random.integers(len(self.kept), size=(n, self._rivals))
        here = self._situation(np.tile(row, (n, 1)), ends)
        away = (self._where[drawn_of] - here[:, None]) / self._unit
        nearest = (away**2).sum(axis=2).argmin(axis=1)
        told = self.kept[drawn_of[np.arange(n), nearest]]
        far = scale(n, random)[:, None] * (random.random(told.shape) < 0.5)
        told = told + random.normal(size=told.shape) * far * self._range
        if deed.turn is not None:  # the object may be turned otherwise than it was
            anew = random.random(n) < 0.5
            drawn = random.uniform(deed.low[deed.turn], deed.high[deed.turn], n)
            told[anew, deed.turn] = drawn[anew]
        told[:, deed.end] = ends
        return self.placed(row, told)

    def placed(self, row: Array, told: Array) -> Array:
        """Numbers of actions that are told from an object, at its row."""
        deed = self._relation.deed
        numbers = told.copy()
        if deed.height is not None:
            numbers[:, deed.height] += row[2]
        offset = told[:, deed.start]
        if deed.turn is None:  # the direction of the push follows from where it begins
            numbers[:, deed.start] = pushed_from(row[:2], offset, told[:, deed.end])
        else:
            angle = told[:, deed.turn]
            low, high = deed.low[deed.turn], deed.high[deed.turn]
            numbers[:, deed.turn] = low + (angle - low) % (high - low)
            numbers[:, deed.start] = row[:2] + turned(offset, angle)
        return np.clip(numbers, deed.low, deed.high)


def pushed_from(place: Array, offsets: Array, ends: Array) -> Array:
    """Where pushes to (n, 2) ends begin, that come by a place at (n, 2) offsets in their frame.

    The push's direction d solves place + R(d) offset + s d = end with s > 0.
    """
    to_end = ends - place
    distance = np.linalg.norm(to_end, axis=1)
    across = np.clip(offsets[:, 1], -distance, distance)
    angle = np.arctan2(to_end[:, 1], to_end[:, 0]) - np.arcsin(
        across / np.maximum(distance, np.finfo(float).tiny)
    )
    return np.asarray(place + turned(np.column_stack([offsets[:, 0], across]), angle))


def aimed(relation: Relation, row: Array, ends: Array, random: np.random.Generator) -> Array:
    """Random actions to (n, 2) ends that begin near an object, (n, P).

    How near is drawn, each order of magnitude as often, and so is how upright the hand is; it
    comes as low as the object is, or higher; all other numbers are anywhere in their ranges.
    """
    deed, n = relation.deed, len(ends)
    numbers = random.uniform(deed.low, deed.high, (n, len(deed.low)))
    for lean in deed.leans:
        numbers[:, lean] = scale(n, random) * deed.high[lean]
    if deed.height is not None:
        numbers[:, deed.height] += row[2] - deed.low[deed.height]
    direction = random.uniform(-np.pi, np.pi, n)
    reach = scale(n, random)[:, None] * (deed.high - deed.low)[list(deed.start)].mean()
    numbers[:, deed.start] = row[:2] + reach * np.column_stack(
        [np.cos(direction), np.sin(direction)]
    )
    numbers[:, deed.end] = ends
    return np.clip(numbers, deed.low, deed.high)


def scale(n: int, random: np.random.Generator) -> Array:
    """N shares of a range, each order of magnitude as likely."""
    return np.asarray(np.exp(random.uniform(np.log(NEAREST), np.log(FARTHEST), n)))
