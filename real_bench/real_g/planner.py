"""What a planner does: it learns what actions do to an object, and finds one that helps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from real_bench.real_g.arrays import Array

Propose = Callable[[Array, Array], Array]
"""From an object's row and (n, 2) positions where the hand should end to n actions' parameters,
(n, P)."""


@dataclass(frozen=True)
class Choice:
    """An action for an object.

    Attributes:
        parameters: of the action, (P,).
        expected_distance: from the goal in the end, metres; how later actions and risks count is
            the planner's.
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


class Planner(Protocol):
    """Plans for one object, once it has learned from a whole play."""

    @property
    def has_learned(self) -> bool:
        """Whether there was enough to learn from."""

    def learn(self, before: Array, after: Array, parameters: Array) -> None:
        """Learn from n actions, and from no others.

        Args:
            before: the object's rows, (n, 3 or 7).
            after: its rows after each.
            parameters: the actions', (n, P).
        """

    def start_trial(self) -> None:
        """Forget what was observed in the last trial."""

    def observe(self, before: Array, after: Array, parameters: Array) -> None:
        """See what its last choice did: the object's rows before and after it."""

    def choose(
        self, row: Array, goal: Array, n_left: int, propose: Propose, random: np.random.Generator
    ) -> Choice:
        """The action after which the object will be nearest to a goal in the end.

        Args:
            row: of the object now, (3 or 7,).
            goal: where it should be, (3,).
            n_left: actions that the trial allows after this one.
            propose: proposes actions.
            random: draws.
        """

    def get_state(self) -> dict[str, Any]:
        """What it has learned."""

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with what it has learned."""
