"""Planning with a model: samples actions, considering those that a trial has left."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from real_bench.real_g.model import MIN_ACTIONS, Mixture, OutcomeModel
from real_bench.real_g.planner import Choice, Propose
from real_bench.real_g.relation import Relation
from real_bench.settings import Settings

Array = NDArray[np.float64]


class PlannerSettings(Settings):
    """Settings of planning with a model; where actions are repeated (pushes) there is none.

    Attributes:
        samples: candidate actions per object in each round.
        rounds: how often the best of them are varied.
    """

    samples: int = Field(1000, ge=20)
    rounds: int = Field(3, ge=1)


class ModelPlanner:
    """Finds the action after which an object will be nearest to a goal in the end.

    An action that fails can be tried again. With n actions left after it, an outcome at distance d
    is worth min(d, f(n)), where f(n) is what can be expected of n actions like the best one:
    f(1) the mean distance after one, f(n) the mean of min(d, f(n - 1)). So it takes risks while
    there are actions left to correct them.

    Args:
        relation: of actions to objects.
        seed: of the model.
        steps: of its training.
        settings: how many actions it tries.
    """

    def __init__(
        self, relation: Relation, seed: int, steps: int, settings: PlannerSettings
    ) -> None:
        primitive = relation.primitive
        reach = float((primitive.high - primitive.low)[list(primitive.end)].mean())
        self._relation, self._model = relation, OutcomeModel(seed, scale=reach)
        self._steps, self._settings = steps, settings

    @property
    def has_learned(self) -> bool:
        """Whether there was enough to learn from."""
        return self._model.is_trained

    def learn(self, before: Array, after: Array, parameters: Array) -> None:
        """Train the model; too few actions are not learned from."""
        if len(before) < MIN_ACTIONS:
            return
        relation = self._relation
        self._model.train(
            relation.features(before, parameters),
            relation.outcome(before, after, parameters),
            relation.static_outcome(parameters),
            self._steps,
        )

    def start_trial(self) -> None:
        """Nothing to forget."""

    def observe(self, before: Array, after: Array, parameters: Array) -> None:
        """Nothing: its model is of the whole play, and a few actions change it too little."""

    def choose(
        self, row: Array, goal: Array, n_left: int, propose: Propose, random: np.random.Generator
    ) -> Choice:
        """The best of the actions that it tries."""
        primitive = self._relation.primitive
        reach = (primitive.high - primitive.low)[list(primitive.end)]
        n = self._settings.samples
        spread = reach * _sample_shares(n, random)[:, None]
        ends = goal[:2] + random.normal(size=(n, 2)) * spread
        parameters = propose(
            np.clip(ends, primitive.low[list(primitive.end)], primitive.high[list(primitive.end)])
        )
        kept, values = parameters[:0], np.empty(0)
        floor = np.inf
        for number in range(self._settings.rounds):
            weights, distances = self.distances(row, goal, parameters)
            if number == 0:
                floor = expected_after(weights, distances, n_left)
            parameters = np.concatenate([kept, parameters])
            values = np.concatenate([values, (weights * np.minimum(distances, floor)).sum(axis=1)])
            order = np.argsort(values, kind="stable")[: max(1, n // 20)]
            kept, values = parameters[order], values[order]
            if number < self._settings.rounds - 1:
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

    def get_state(self) -> dict[str, Any]:
        """What its model has learned."""
        return self._model.get_state()

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with that."""
        self._model.set_state(state)


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
