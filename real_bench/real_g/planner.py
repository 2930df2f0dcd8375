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
"""From (n, 2) places where the hand should end to n actions' numbers, (n, P)."""


@dataclass(frozen=True)
class Choice:
    """An action for an object.

    Attributes:
        numbers: of the action, (P,).
        expected: mean distance from the goal in the end, metres, including all later actions.
        now: how far it is now.
        end: where it is expected after this action, (3,).
    """

    numbers: Array
    expected: float
    now: float
    end: Array

    @property
    def gain(self) -> float:
        """How much nearer the object comes."""
        return self.now - self.expected


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
        left: int,
        propose: Propose,
        random: np.random.Generator,
    ) -> Choice:
        """The best of the candidate actions.

        Args:
            row: of the object now, (3 or 7,).
            goal: where it should be, (3,).
            left: actions that the trial allows after this one.
            propose: proposes actions.
            random: draws.
        """
        deed = self._relation.deed
        reach = (deed.high - deed.low)[list(deed.end)]
        n = self._samples
        spread = reach * _shares(n, random)[:, None]
        ends = goal[:2] + random.normal(size=(n, 2)) * spread
        numbers = propose(np.clip(ends, deed.low[list(deed.end)], deed.high[list(deed.end)]))
        kept, values = numbers[:0], np.empty(0)
        floor = np.inf
        for number in range(self._rounds):
            weights, away = self.distances(row, goal, numbers)
            if number == 0:
                floor = expected_after(weights, away, left)
            numbers = np.concatenate([kept, numbers])
            values = np.concatenate([values, (weights * np.minimum(away, floor)).sum(axis=1)])
            order = np.argsort(values, kind="stable")[: max(1, n // 20)]
            kept, values = numbers[order], values[order]
            if number < self._rounds - 1:
                parents = kept[random.integers(len(kept), size=n)]
                share = _shares(n, random)[:, None] / 2 ** (number + 1)
                noise = random.normal(size=parents.shape) * share * (deed.high - deed.low)
                noise *= random.random(parents.shape) < 0.5
                numbers = np.clip(parents + noise, deed.low, deed.high)
        weights, away = self.distances(row, goal, kept[:1])
        floor = expected_after(weights, away, left)
        expected = float((weights * np.minimum(away, floor)).sum())
        return Choice(
            kept[0], expected, float(np.linalg.norm(row[:3] - goal)), self.end(row, kept[0])
        )

    def distances(self, row: Array, goal: Array, numbers: Array) -> tuple[Array, Array]:
        """How likely n actions end how far from a goal: two arrays (n, E K)."""
        rows, mixture = self.predicted(row, numbers)
        means = np.moveaxis(mixture.means, 0, 1)  # n, E, K, 3
        ends = self._relation.ends(rows, means, numbers)
        spread = np.moveaxis(mixture.deviations, 0, 1)
        away = np.sqrt(((ends - goal) ** 2).sum(axis=-1) + (spread**2).sum(axis=-1))
        weights = np.moveaxis(mixture.weights, 0, 1) / len(mixture.weights)
        return weights.reshape(len(numbers), -1), away.reshape(len(numbers), -1)

    def predicted(
        self, row: Array, numbers: Array, member: int | None = None
    ) -> tuple[Array, Mixture]:
        """The object's row for each of n actions, and what they are expected to do."""
        rows = np.tile(row, (len(numbers), 1))
        relation = self._relation
        features = relation.features(rows, numbers)
        return rows, self._model.predict(features, relation.stays(numbers), member)

    def end(self, row: Array, numbers: Array) -> Array:
        """Where the object most likely is after an action, (3,)."""
        rows, mixture = self.predicted(row, numbers[None])
        ends = self._relation.ends(rows, np.moveaxis(mixture.means, 0, 1), numbers[None])[0]
        best = np.unravel_index(int(mixture.weights[:, 0].argmax()), mixture.weights[:, 0].shape)
        return np.asarray(ends[best])


def expected_after(weights: Array, away: Array, left: int) -> float:
    """f(left): the least mean distance that ``left`` more actions can bring.

    Args:
        weights: how likely each of M outcomes of n kinds of actions is, (n, M).
        away: how far it is from the goal, (n, M).
        left: how many actions; infinite for none.
    """
    floor = np.inf
    for _ in range(left):
        floor = float((weights * np.minimum(away, floor)).sum(axis=1).min())
    return floor


def _shares(n: int, random: np.random.Generator) -> Array:
    return np.asarray(np.exp(random.uniform(np.log(0.002), np.log(0.2), n)))
