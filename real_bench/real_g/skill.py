"""A skill with one object: a memory of actions, and which of them it follows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from real_bench.real_g.arrays import Array
from real_bench.real_g.memory import ActionMemory, sample_near_object
from real_bench.real_g.model import MIN_ACTIONS, ContingencyModel
from real_bench.real_g.relation import Relation


class Skill:
    """Proposes actions for an object, and knows which it will follow.

    Args:
        relation: of actions to objects.
        memory: of what went well with it.
        seed: of the models.
        fresh: the share of proposed actions that do not come from memory.
    """

    def __init__(self, relation: Relation, memory: ActionMemory, seed: int, fresh: float) -> None:
        self.relation, self.memory, self._fresh = relation, memory, fresh
        self.contingency = ContingencyModel(seed)

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

    def propose(self, row: Array, goals: Array, random: np.random.Generator) -> Array:
        """Actions for an object at a row, (n, P), one for each of (n, G) goals."""
        recalls = self.has_learned and bool(self.memory.families)
        n_fresh = int(len(goals) * self._fresh) if recalls else len(goals)
        fresh = sample_near_object(self.relation, row, goals[:n_fresh], random)
        if n_fresh == len(goals):
            return fresh
        return np.concatenate([fresh, self.memory.sample_variations(row, goals[n_fresh:], random)])

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
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with what it has learned."""
        self.memory.set_state(state["memory"])
        self.contingency.set_state(state["contingency"])
