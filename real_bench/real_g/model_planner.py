"""Planning with a model: samples actions, considering those that a trial has left."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import Field

from real_bench.real_g.arrays import Array
from real_bench.real_g.model import MIN_ACTIONS, OutcomeModel
from real_bench.real_g.planner import Choice, Propose
from real_bench.real_g.relation import Relation
from real_bench.real_g.trial_evidence import TrialEvidence
from real_bench.settings import Settings


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

    What fails can be mended while there are actions left. So an outcome at distance d is worth
    min(d, f), where f is what can still be expected from where the best action would leave the
    object if it failed: a risk is taken where there is a way back. A failure may be repeated, so
    to try again helps only as far as a member of the ensemble holds an outcome to be chance. And
    what was done in this trial tells of actions like it (:mod:`real_bench.real_g.trial_evidence`).

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
        self._ends = list(primitive.end)
        self._reach = (primitive.high - primitive.low)[self._ends]
        self._relation = relation
        self._model = OutcomeModel(seed, scale=float(self._reach.mean()))
        self._steps, self._settings = steps, settings
        self.start_trial()

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
        """Forget what the last trial's actions did."""
        self._evidence = TrialEvidence(self._relation)

    def observe(self, before: Array, after: Array, parameters: Array) -> None:
        """Remember until the trial ends what an action did."""
        self._evidence.add(before, after, parameters)

    def choose(
        self, row: Array, goal: Array, n_left: int, propose: Propose, random: np.random.Generator
    ) -> Choice:
        """The best of the actions that it tries."""
        parameters = self._proposed(row, goal, propose, random)
        weights, distances = self.distances(row, goal, parameters)
        floor = np.inf
        if n_left > 0:
            best = int(after_attempts(weights, distances, n_left + 1).argmin())
            lost = self._after_failure(row, goal, parameters[best])
            back = self._proposed(lost, goal, propose, random)
            floor = float(after_attempts(*self.distances(lost, goal, back), n_left).min())
        kept, values = parameters[:0], np.empty(0)
        for number in range(self._settings.rounds):
            if number > 0:
                weights, distances = self.distances(row, goal, parameters)
            parameters = np.concatenate([kept, parameters])
            values = np.concatenate([values, expected_distances(weights, distances, floor)])
            order = np.argsort(values, kind="stable")[: max(1, self._settings.samples // 20)]
            kept, values = parameters[order], values[order]
            parameters = self._varied(kept, number + 1, random)
        away = float(np.linalg.norm(row[:3] - goal))
        return Choice(kept[0], float(values[0]), away, self.end(row, kept[0]))

    def distances(self, row: Array, goal: Array, parameters: Array) -> tuple[Array, Array]:
        """How likely n actions end how far from a goal, for each member: two arrays (n, E, K).

        The outcomes of the trial's own actions are among the K.
        """
        ends, weights, spread = self._outcomes(row, parameters)
        distances = np.sqrt(((ends - goal) ** 2).sum(axis=-1) + spread)
        if len(self._evidence):
            shares, known_ends = self._evidence.of(row, parameters)
            size = *weights.shape[:2], shares.shape[1]
            known = np.broadcast_to(np.linalg.norm(known_ends - goal, axis=1), size)
            told = np.broadcast_to(shares[:, None], size)
            weights = np.concatenate([weights, told], axis=2)
            weights /= weights.sum(axis=2, keepdims=True)
            distances = np.concatenate([distances, known], axis=2)
        return weights, distances

    def end(self, row: Array, parameters: Array) -> Array:
        """Where the object most likely is after an action, (3,)."""
        ends, weights, _ = self._outcomes(row, parameters[None])
        return np.asarray(ends[0].reshape(-1, 3)[int(weights[0].argmax())])

    def _outcomes(self, row: Array, parameters: Array) -> tuple[Array, Array, Array]:
        """Of n actions by the model: ends (n, E, K, 3), weights and square spreads (n, E, K)."""
        relation, rows = self._relation, np.tile(row, (len(parameters), 1))
        features = relation.features(rows, parameters)
        mixture = self._model.predict(features, relation.static_outcome(parameters))
        means, weights, deviations = (
            np.moveaxis(each, 0, 1) for each in (mixture.means, mixture.weights, mixture.deviations)
        )
        ends = relation.end_positions(rows, means, parameters)
        return ends, weights, (deviations**2).sum(axis=-1)

    def _after_failure(self, row: Array, goal: Array, parameters: Array) -> Array:
        """The object's row after that outcome of an action that adds most to its distance."""
        ends, weights, _ = self._outcomes(row, parameters[None])
        harm = weights[0] * np.linalg.norm(ends[0] - goal, axis=-1)
        lost = row.copy()
        lost[:3] = ends[0].reshape(-1, 3)[int(harm.argmax())]
        return lost

    def _proposed(
        self, row: Array, goal: Array, propose: Propose, random: np.random.Generator
    ) -> Array:
        """Actions to around the goal, near and far, (n, P)."""
        primitive, n = self._relation.primitive, self._settings.samples
        spread = self._reach * _sample_shares(n, random)[:, None]
        ends = goal[:2] + random.normal(size=(n, 2)) * spread
        return propose(row, np.clip(ends, primitive.low[self._ends], primitive.high[self._ends]))

    def _varied(self, kept: Array, number: int, random: np.random.Generator) -> Array:
        """Variations of the best actions, (n, P), smaller from round to round."""
        primitive, n = self._relation.primitive, self._settings.samples
        parents = kept[random.integers(len(kept), size=n)]
        share = _sample_shares(n, random)[:, None] / 2**number
        noise = random.normal(size=parents.shape) * share * (primitive.high - primitive.low)
        noise *= random.random(parents.shape) < 0.5
        return np.asarray(np.clip(parents + noise, primitive.low, primitive.high))

    def get_state(self) -> dict[str, Any]:
        """What its model has learned."""
        return self._model.get_state()

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with that."""
        self._model.set_state(state)


def expected_distances(weights: Array, distances: Array, floor: float) -> Array:
    """What n actions leave on average, (n,), where whatever is farther can be mended to a floor.

    Args:
        weights: how likely each of K outcomes is for each member, (n, E, K), their sum 1.
        distances: how far it is from the goal, (n, E, K).
        floor: what can be reached afterwards.
    """
    return np.asarray((weights * np.minimum(distances, floor)).sum(axis=2).mean(axis=1))


def after_attempts(weights: Array, distances: Array, n_attempts: int) -> Array:
    """What each of n actions leaves on average, (n,), if it is repeated while that helps.

    Members do not change their minds: what one of them holds to fail fails every time.

    Args:
        weights: how likely each of K outcomes is for each member, (n, E, K), their sum 1.
        distances: how far it is from the goal, (n, E, K).
        n_attempts: at most so often; with none nothing can be expected (infinite).
    """
    floor = np.full((*weights.shape[:2], 1), np.inf)
    for _ in range(n_attempts):
        floor = (weights * np.minimum(distances, floor)).sum(axis=2, keepdims=True)
    return np.asarray(floor[:, :, 0].mean(axis=1))


def _sample_shares(n: int, random: np.random.Generator) -> Array:
    return np.asarray(np.exp(random.uniform(np.log(0.002), np.log(0.2), n)))
