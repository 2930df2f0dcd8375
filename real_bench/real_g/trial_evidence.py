"""What the actions of the present trial did, and what that tells of others."""

from __future__ import annotations

import numpy as np

from real_bench.real_g.arrays import Array
from real_bench.real_g.relation import Relation, random_distance

ALIKE = 1 / 3
"""Actions so far apart still tell of each other: a share of the distance of two random ones."""

NEAR = 0.1
"""So do places of an object, as a share of the range of places where an action can end."""


class TrialEvidence:
    """The actions of a trial, and what the object did.

    A model may be sure of what is not so, and a few actions do not change it. But the same action
    with the object at the same place does the same again.

    Args:
        relation: of actions to objects.
    """

    def __init__(self, relation: Relation) -> None:
        primitive = relation.primitive
        self._relation, self._range = relation, primitive.high - primitive.low
        self._radius = ALIKE * random_distance(len(self._range))
        self._reach = NEAR * self._range[list(primitive.end)]
        self._actions: list[Array] = []  # relative to the object
        self._places: list[Array] = []
        self._ways: list[Array] = []

    def __len__(self) -> int:
        return len(self._ways)

    def add(self, before: Array, after: Array, parameters: Array) -> None:
        """One more action, (P,), with the object's rows before and after it, (3 or 7,) each."""
        self._actions.append(self._relation.relative(before[None], parameters[None])[0])
        self._places.append(before[:2])
        self._ways.append(after[:3] - before[:3])

    def of(self, row: Array, parameters: Array) -> tuple[Array, Array]:
        """How much each of k actions tells of n others, (n, k), 1 for the same one; and its end.

        Args:
            row: of the object now.
            parameters: of the others, (n, P).

        Returns:
            The shares, and where the object would end, (k, 3).
        """
        others = self._relation.relative(np.tile(row, (len(parameters), 1)), parameters)
        offsets = (others[:, None] - np.array(self._actions)) / self._range / self._radius
        moved = (row[:2] - np.array(self._places)) / self._reach
        unlike = (offsets**2).sum(axis=2) + (moved**2).sum(axis=1)
        return np.exp(-unlike / 2), row[:3] + np.array(self._ways)
