"""Planning by doing again what was done, without a model: for actions of few parameters.

Those of a play lie so densely that for nearly every goal one is known that would bring the object
there, and that similar actions show whether it can be relied on.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from real_bench.real_g.planner import Choice, Propose
from real_bench.real_g.relation import Relation, rotate

Array = NDArray[np.float64]

N_SIMILAR = 5
"""An action is expected to do what it and the actions most like it did, this many in all."""

TURN_M = 0.05
"""A radian between the directions of two actions counts as this far, when similar ones are sought.
The other coordinates are metres."""

FIELDS = ("before", "after", "parameters")


class ReplayPlanner:
    """The actions of a play on an object, and what they did to it.

    Args:
        relation: of actions to objects.
    """

    def __init__(self, relation: Relation) -> None:
        self._relation = relation
        n_parameters = len(relation.primitive.low)
        self.learn(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, n_parameters)))

    @property
    def has_learned(self) -> bool:
        """Whether it remembers any action."""
        return len(self._parameters) > 0

    def learn(self, before: Array, after: Array, parameters: Array) -> None:
        """Remember n actions, and no others."""
        self._before, self._after, self._parameters = before[:, :3], after[:, :3], parameters
        keys = self._keys()
        n, k = len(keys), min(len(keys), N_SIMILAR)
        similar = np.zeros((n, k), np.int64)
        if n:
            similar = scipy.spatial.cKDTree(keys).query(keys, k)[1].reshape(n, k)
        displacement = self._after - self._before
        flat = rotate(displacement[:, :2], -self._relation.angle(parameters))
        self._displacements = np.column_stack([flat, displacement[:, 2]])[similar]

    def choose(
        self, row: Array, goal: Array, n_left: int, propose: Propose, random: np.random.Generator
    ) -> Choice:
        """The action that leaves the object nearest to a goal, by the mean over similar ones.

        Later actions are not considered, and only actions of the play.
        """
        away = float(np.linalg.norm(row[:3] - goal))
        parameters, ends = self.candidates(row)
        if not len(parameters):
            return Choice(self._relation.primitive.low, away, away, row[:3])
        distances = np.linalg.norm(ends - goal, axis=2).mean(axis=1)
        best = int(distances.argmin())
        return Choice(parameters[best], float(distances[best]), away, ends[best].mean(axis=0))

    def candidates(self, row: Array) -> tuple[Array, Array]:
        """What can be done again to an object at a row: m actions' parameters, (m, P), and ends.

        An action is repeated where it would begin and end at the same place relative to the object.
        The ends, (m, k, 3), are where the object would be, had it gone as after each of k similar
        actions.
        """
        primitive = self._relation.primitive
        parameters, shift = self._parameters.copy(), row[:2] - self._before[:, :2]
        for place in (primitive.start, primitive.end):
            parameters[:, place] += shift
        fits = ((parameters >= primitive.low) & (parameters <= primitive.high)).all(axis=1)
        parameters, displacements = parameters[fits], self._displacements[fits]
        flat = rotate(displacements[..., :2], self._relation.angle(parameters)[:, None])
        return parameters, row[:3] + np.concatenate([flat, displacements[..., 2:]], axis=2)

    def get_state(self) -> dict[str, Any]:
        """What it remembers, as arrays."""
        return dict(zip(FIELDS, (self._before, self._after, self._parameters), strict=True))

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Remember it again."""
        self.learn(*(np.asarray(state[field], np.float64) for field in FIELDS))

    def _keys(self) -> Array:
        """Coordinates in which similar actions are near, (n, 5): start, length and direction."""
        relation, parameters = self._relation, self._parameters
        angle = relation.angle(parameters)
        start = relation.relative(self._before, parameters)[:, relation.primitive.start]
        length = np.linalg.norm(relation.displacement(parameters), axis=1)
        return np.column_stack([start, length, TURN_M * np.cos(angle), TURN_M * np.sin(angle)])
