"""Planning by doing again what was done, without a model: for actions of few parameters.

Those of a play lie so densely that for nearly every goal one is known that would bring the object
about there, and that similar actions show whether it can be relied on.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from real_bench.real_g.arrays import Array
from real_bench.real_g.known_actions import KnownActions
from real_bench.real_g.planner import Choice, Propose
from real_bench.real_g.relation import Relation

N_CANDIDATES = 500
"""The actions of the play that would end nearest to the goal, if they did again what they did."""

N_CORRECTED = 100
"""The best of them are tried longer and shorter, too."""

CORRECTIONS_M = (-0.02, -0.012, -0.007, -0.004, -0.002, 0.002, 0.004, 0.007, 0.012, 0.02)

FIELDS = ("before", "after", "parameters")


class ReplayPlanner:
    """Repeats, longer or shorter, actions of the play and of the present trial.

    What an action does is told by those most like it. The expected distance from the goal is their
    mean, and their spread divided by the number of actions left: what is left can mend what goes
    wrong.

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
        return len(self._play) > 0

    def learn(self, before: Array, after: Array, parameters: Array) -> None:
        """Remember n actions, and no others."""
        self._play = KnownActions(self._relation, before, after, parameters)
        self.start_trial()

    def start_trial(self) -> None:
        """Forget what was done in the last trial."""
        self._known = self._play

    def observe(self, before: Array, after: Array, parameters: Array) -> None:
        """Remember until the trial ends what an action did: the same push does the same again."""
        self._known = self._known.and_also(before, after, parameters)

    def choose(
        self, row: Array, goal: Array, n_left: int, propose: Propose, random: np.random.Generator
    ) -> Choice:
        """The action that is expected to leave the object nearest to a goal."""
        away = float(np.linalg.norm(row[:3] - goal))
        candidates = self._candidates(row, goal)
        if not len(candidates):
            return Choice(self._relation.primitive.low, away, away, row[:3])
        worth = self._expected_distances(row, goal, n_left, candidates)
        best = np.argsort(worth, kind="stable")[:N_CORRECTED]
        tried = self._known.parameters[len(self._play) :]  # in this trial
        corrected = self._corrected(np.vstack([candidates[best], tried]))
        candidates = np.vstack([candidates[best], corrected])
        worth = np.append(worth[best], self._expected_distances(row, goal, n_left, corrected))
        chosen = candidates[[int(worth.argmin())]]
        ends, weights = self._known.outcomes(row, chosen)
        return Choice(chosen[0], float(worth.min()), away, weights[0] @ ends[0])

    def get_state(self) -> dict[str, Any]:
        """What it remembers of the play, as arrays."""
        play = self._play
        return dict(zip(FIELDS, (play.before, play.after, play.parameters), strict=True))

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Remember it again."""
        self.learn(*(np.asarray(state[field], np.float64) for field in FIELDS))

    def _candidates(self, row: Array, goal: Array) -> Array:
        """Parameters of actions of the play that would end near the goal, (n, P)."""
        parameters, ends = self._play.repeated(row)
        distances = np.linalg.norm(ends - goal, axis=1)
        return parameters[np.argsort(distances, kind="stable")[:N_CANDIDATES]]

    def _corrected(self, parameters: Array) -> Array:
        """Actions that go on a little longer, or stop before, (n, P)."""
        primitive, displacement = self._relation.primitive, self._relation.displacement(parameters)
        direction = displacement / np.maximum(
            np.linalg.norm(displacement, axis=1, keepdims=True), np.finfo(float).tiny
        )
        corrected = np.tile(parameters, (len(CORRECTIONS_M), 1))
        corrected[:, primitive.end] += np.kron(np.array(CORRECTIONS_M)[:, None], direction)
        fits = ((corrected >= primitive.low) & (corrected <= primitive.high)).all(axis=1)
        return corrected[fits]

    def _expected_distances(self, row: Array, goal: Array, n_left: int, actions: Array) -> Array:
        ends, weights = self._known.outcomes(row, actions)
        distances = np.linalg.norm(ends - goal, axis=2)
        means = (weights * distances).sum(axis=1)
        spreads = np.sqrt((weights * (distances - means[:, None]) ** 2).sum(axis=1))
        return np.asarray(means + spreads / (n_left + 1))
