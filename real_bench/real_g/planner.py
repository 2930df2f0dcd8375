"""Which action next: samples through the model, considering the actions left in a trial."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from real_bench.real_g.model import Mixture, OutcomeModel
from real_bench.real_g.relation import Relation

Array = NDArray[np.float64]

Propose = Callable[[Array], Array]
"""From (n, 2) positions where the hand should end to n actions' parameters, (n, P)."""


@dataclass(frozen=True)
class Choice:
    """An action for an object.

    Attributes:
        parameters: of the action, (P,).
        expected_distance: mean distance from the goal in the end, metres, including all later
            actions.
        distance_now: how far it is now.
        expected_end: where it is expected after this action, (3,).
    """

    parameters: Array
    expected_distance: float
    distance_now: float
    expected_end: Array

    @property
    def gain(self) -> float:
        """How much nearer the object comes."""
        return self.distance_now - self.expected_distance


class Planner:
    """Finds the action after which an object will be nearest to a goal in the end.

    An action that fails can be tried again. With n actions left after it, an outcome at distance d
    is worth min(d, f(n)), where f(n) is what can be expected of n actions like the best one:
    f(1) the mean distance after one, f(n) the mean of min(d, f(n - 1)). So it takes risks while
    there are actions left to correct them.

    Args:
        relation, model: what actions do to the object.
        samples: candidate actions in each round.
        rounds: how often the best are varied.
    """

    def __init__(
        self, relation: Relation, model: OutcomeModel, samples: int = 1000, rounds: int = 3
    ) -> None:
        self._relation, self._model = relation, model
        self._samples, self._rounds = samples, rounds

    def choose(
        self,
        row: Array,
        goal: Array,
        n_left: int,
        propose: Propose,
        random: np.random.Generator,
    ) -> Choice:
        """The best of the candidate actions.

        Args:
            row: of the object now, (3 or 7,).
            goal: where it should be, (3,).
            n_left: actions that the trial allows after this one.
            propose: proposes actions.
            random: draws.
        """
        primitive = self._relation.primitive
        reach = (primitive.high - primitive.low)[list(primitive.end)]
        n = self._samples
        spread = reach * _sample_shares(n, random)[:, None]
        ends = goal[:2] + random.normal(size=(n, 2)) * spread
        parameters = propose(
            np.clip(ends, primitive.low[list(primitive.end)], primitive.high[list(primitive.end)])
        )
        kept, values = parameters[:0], np.empty(0)
        floor = np.inf
        for number in range(self._rounds):
            weights, distances = self.distances(row, goal, parameters)
            if number == 0:
                floor = expected_after(weights, distances, n_left)
            parameters = np.concatenate([kept, parameters])
            values = np.concatenate([values, (weights * np.minimum(distances, floor)).sum(axis=1)])
            order = np.argsort(values, kind="stable")[: max(1, n // 20)]
            kept, values = parameters[order], values[order]
            if number < self._rounds - 1:
                parents = kept[random.integers(len(kept), size=n)]
                share = _sample_shares(n, random)[:, None] / 2 ** (number + 1)
                noise = random.normal(size=parents.shape) * share * (primitive.high - primitive.low)
                noise *= random.random(parents.shape) < 0.5
                parameters = np.clip(parents + noise, primitive.low, primitive.high)
        weights, distances = self.distances(row, goal, kept[:1])
        floor = expected_after(weights, distances, n_left)
        expected = float((weights * np.minimum(distances, floor)).sum())
        return Choice(
            kept[0], expected, float(np.linalg.norm(row[:3] - goal)), self.end(row, kept[0])
        )

    def distances(self, row: Array, goal: Array, parameters: Array) -> tuple[Array, Array]:
        """How likely n actions end how far from a goal: two arrays (n, E K)."""
        rows, mixture = self.predict(row, parameters)
        means = np.moveaxis(mixture.means, 0, 1)  # n, E, K, 3
        ends = self._relation.end_positions(rows, means, parameters)
        spread = np.moveaxis(mixture.deviations, 0, 1)
        distances = np.sqrt(((ends - goal) ** 2).sum(axis=-1) + (spread**2).sum(axis=-1))
        weights = np.moveaxis(mixture.weights, 0, 1) / len(mixture.weights)
        return weights.reshape(len(parameters), -1), distances.reshape(len(parameters), -1)

    def predict(
        self, row: Array, parameters: Array, member: int | None = None
    ) -> tuple[Array, Mixture]:
        """The object's row for each of n actions, and what they are expected to do."""
        rows = np.tile(row, (len(parameters), 1))
        relation = self._relation
        features = relation.features(rows, parameters)
        return rows, self._model.predict(features, relation.static_outcome(parameters), member)

    def end(self, row: Array, parameters: Array) -> Array:
        """Where the object most likely is after an action, (3,)."""
        rows, mixture = self.predict(row, parameters[None])
        ends = self._relation.end_positions(
            rows, np.moveaxis(mixture.means, 0, 1), parameters[None]
        )[0]
        best = np.unravel_index(int(mixture.weights[:, 0].argmax()), mixture.weights[:, 0].shape)
        return np.asarray(ends[best])


def expected_after(weights: Array, distances: Array, n_left: int) -> float:
    """f(left): the least mean distance that ``n_left`` more actions can bring.

    Args:
        weights: how likely each of M outcomes of n kinds of actions is, (n, M).
        distances: how far it is from the goal, (n, M).
        n_left: how many actions; infinite for none.
    """
    floor = np.inf
    for _ in range(n_left):
        floor = float((weights * np.minimum(distances, floor)).sum(axis=1).min())
    return floor


def _sample_shares(n: int, random: np.random.Generator) -> Array:
    return np.asarray(np.exp(random.uniform(np.log(0.002), np.log(0.2), n)))
