"""A skill with one object: a memory of actions, and what they do to it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.real_g.memory import ActionMemory, sample_near_object
from real_bench.real_g.model import ContingencyModel, OutcomeModel
from real_bench.real_g.relation import Relation
from real_bench.real_g.replay import Replay

Array = NDArray[np.float64]

UNVARIED_SHARE = 0.3
"""The share of candidate actions that do not come from memory."""

MIN_ACTIONS = 30
"""The fewest actions to learn from."""


class Skill:
    """Proposes actions for an object, and predicts their outcomes.

    Args:
        relation: of actions to objects.
        memory: of what went well with it.
        seed: of the models.
    """

    def __init__(self, relation: Relation, memory: ActionMemory, seed: int) -> None:
        primitive = relation.primitive
        reach = float((primitive.high - primitive.low)[list(primitive.end)].mean())
        self.relation, self.memory = relation, memory
        self.contingency = ContingencyModel(seed)
        self.model = OutcomeModel(seed, scale=reach)
        self.replay = Replay(relation)

    @property
    def has_learned(self) -> bool:
        """Whether it has learned anything yet."""
        return self.contingency.is_trained

    def learn(self, before: Array, after: Array, parameters: Array, steps: int) -> None:
        """Learn again what the object follows, from n actions.

        Args:
            before: the object's rows, (n, 3 or 7).
            after: its rows after each.
            parameters: the actions', (n, P).
            steps: of training.
        """
        if len(before) < MIN_ACTIONS:
            return
        followed = self.relation.contingency(before, after, parameters)
        self.contingency.train(self.relation.features(before, parameters), followed, steps)

    def learn_outcomes(self, before: Array, after: Array, parameters: Array, steps: int) -> None:
        """Learn again where the object ends; arguments as in :meth:`learn`."""
        if len(before) < MIN_ACTIONS:
            return
        relation = self.relation
        if relation.primitive.is_repeatable:
            self.replay.learn(before, after, parameters)
            return
        self.model.train(
            relation.features(before, parameters),
            relation.outcome(before, after, parameters),
            relation.static_outcome(parameters),
            steps,
        )

    def propose(self, row: Array, ends: Array, random: np.random.Generator) -> Array:
        """N actions for an object at a row, (n, P), that end the hand at (n, 2) positions."""
        if not self.has_learned or not self.memory.families:
            return sample_near_object(self.relation, row, ends, random)
        n_new = int(len(ends) * UNVARIED_SHARE)
        return np.concatenate(
            [
                sample_near_object(self.relation, row, ends[:n_new], random),
                self.memory.sample_variations(row, ends[n_new:], random),
            ]
        )

    def most_contingent(self, row: Array, parameters: Array, random: np.random.Generator) -> int:
        """Which of n actions one member of the ensemble expects the object to follow most.

        The member is drawn each time (Thompson sampling): members agree on what is known, and
        differ in their hopes about the rest.
        """
        rows = np.tile(row, (len(parameters), 1))
        member = int(random.integers(self.contingency.members))
        features = self.relation.features(rows, parameters)
        return int(self.contingency.predict(features, member).argmax())

    def get_state(self) -> dict[str, Any]:
        """What it has learned."""
        return {
            "memory": self.memory.get_state(),
            "contingency": self.contingency.get_state(),
            "model": self.model.get_state(),
            "replay": self.replay.get_state(),
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with what it has learned."""
        self.memory.set_state(state["memory"])
        self.contingency.set_state(state["contingency"])
        self.model.set_state(state["model"])
        self.replay.set_state(state["replay"])
