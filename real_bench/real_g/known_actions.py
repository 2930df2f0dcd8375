"""Actions that were tried on an object, and what similar ones are expected to do."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from real_bench.real_g.arrays import Array
from real_bench.real_g.relation import Relation, orientation_features, rotate

N_SIMILAR = 10
"""How many actions tell what a similar one does."""

LENGTH_SCALE, TURN_M, ORIENTATION_M = 0.3, 0.05, 0.004
"""How unlike two actions are, in metres: how far apart they begin, relative to the object. So much
count a metre of difference in length, a radian in direction, one in the features of how the object
lies. Where it is counts as the form of the action says.
"""

PUSHED_M = 0.001
"""An object that moved less was not pushed."""


@dataclass(frozen=True)
class KnownActions:
    """n actions on an object, and where it was before and after.

    Attributes:
        relation: of actions to objects.
        before: the object's rows, (n, 3 or 7).
        after: its rows after each, (n, 3 or 7).
        parameters: the actions', (n, P).
    """

    relation: Relation
    before: Array
    after: Array
    parameters: Array

    def __len__(self) -> int:
        return len(self.parameters)

    def and_also(self, before: Array, after: Array, parameters: Array) -> KnownActions:
        """These and one more, by its rows and parameters."""
        pairs = ((self.before, before), (self.after, after), (self.parameters, parameters))
        grown = [np.vstack([known, one[: known.shape[1]]]) for known, one in pairs]
        return KnownActions(self.relation, *grown)

    def repeated(self, row: Array) -> tuple[Array, Array]:
        """These actions where the object is now: m actions' parameters, (m, P), and ends, (m, 3).

        Each begins and ends at the same place relative to the object as it did; those that would
        not fit into the action space are left out. The ends are where the object would be, had it
        gone as it went.
        """
        primitive = self.relation.primitive
        parameters, shift = self.parameters.copy(), row[:2] - self.before[:, :2]
        for place in (primitive.start, primitive.end):
            parameters[:, place] += shift
        fits = ((parameters >= primitive.low) & (parameters <= primitive.high)).all(axis=1)
        return parameters[fits], row[:3] + self._displacements[fits]

    def outcomes(self, row: Array, parameters: Array) -> tuple[Array, Array]:
        """What similar actions say of m actions: ends, (m, k, 3), and their weights, (m, k).

        What a hand pushed ahead lies at the same place relative to where the hand ended; whatever
        else moved has moved by as much. Weights fall to 0 at the least similar one.
        """
        row = row[: self.before.shape[1]]  # earlier versions kept no orientations
        keys = self._keys(np.repeat(row[None], len(parameters), axis=0), parameters)
        n_similar = min(N_SIMILAR + 1, len(self))
        nearest = self._tree.query(keys, [*range(1, n_similar + 1)])
        distances, similar = np.asarray(nearest[0]), np.asarray(nearest[1])
        weights = _tricube(distances / np.maximum(distances[:, -1:], TINY))
        angle = self.relation.angle(parameters)
        flat = self._flat[similar].copy()
        further = self._end_ahead(row[None], parameters)[:, None] - self._ends_ahead[similar]
        pushed = self._is_pushed[similar]
        flat[..., 0] = np.where(pushed, np.maximum(flat[..., 0] + further, 0), flat[..., 0])
        flat[..., 1] = np.where(pushed & (flat[..., 0] == 0), 0, flat[..., 1])
        height = self._displacements[similar][..., 2:]
        return row[:3] + np.concatenate([rotate(flat, angle[:, None]), height], axis=2), weights

    @cached_property
    def _displacements(self) -> Array:
        return self.after[:, :3] - self.before[:, :3]

    @cached_property
    def _flat(self) -> Array:
        """Displacements in the directions of the actions, (n, 2)."""
        return rotate(self._displacements[:, :2], -self.relation.angle(self.parameters))

    @cached_property
    def _is_pushed(self) -> NDArray[np.bool_]:
        """Whether the object was moved in the direction of the action."""
        has_moved = np.linalg.norm(self._displacements, axis=1) > PUSHED_M
        return np.asarray(has_moved & (self._flat[:, 0] > 0))

    @cached_property
    def _ends_ahead(self) -> Array:
        return self._end_ahead(self.before, self.parameters)

    def _end_ahead(self, rows: Array, parameters: Array) -> Array:
        """How far beyond the object the actions end, in their directions, (n,)."""
        way = parameters[:, self.relation.primitive.end] - rows[:, :2]
        return rotate(way, -self.relation.angle(parameters))[:, 0]

    @cached_property
    def _tree(self) -> scipy.spatial.cKDTree:
        return scipy.spatial.cKDTree(self._keys(self.before, self.parameters))

    def _keys(self, rows: Array, parameters: Array) -> Array:
        """Coordinates in which similar actions are near, (n, K)."""
        relation = self.relation
        angle = relation.angle(parameters)
        start = relation.relative(rows, parameters)[:, relation.primitive.start]
        length = np.linalg.norm(relation.displacement(parameters), axis=1)
        turn = TURN_M * np.column_stack([np.cos(angle), np.sin(angle)])
        keys = [start, LENGTH_SCALE * length, turn]
        if relation.primitive.place_scale:
            keys.append(relation.primitive.place_scale * rows[:, :2])
        if rows.shape[1] == 7:
            keys.append(ORIENTATION_M * orientation_features(rows[:, 3:], angle))
        return np.column_stack(keys)


TINY = np.finfo(float).tiny


def _tricube(shares: Array) -> Array:
    """Weights of the tricube kernel, rows of sum 1; shares are of the kernel's width."""
    weights = (1 - shares**3) ** 3 + 1e-6
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))
