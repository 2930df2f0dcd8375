"""The Planner: A* over triplets, level by level (paper, section REAL-X blueprint, Planner)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from real_bench.errors import RealBenchError
from real_bench.real_x.abstraction import DynamicAbstraction
from real_bench.real_x.neighbours import Neighbours
from real_bench.real_x.search import shortest_path
from real_bench.real_x.triplets import Triplets

DEPTH = 10
"""As many actions as a trial has."""

INDEX_BYTES = 500_000_000
"""Neighbour indices are kept for as many levels as fit in this many bytes."""


@dataclass(frozen=True)
class Plan:
    """The outcome of planning.

    Attributes:
        level: at which the plan was found, from 0; None if there is no plan at any level.
        triplets: numbers of the triplets whose actions lead to the goal, in order; empty if the
            present state already is the goal, or if there is no plan.
        n_expanded: how many nodes were expanded, over all levels that were tried.
    """

    level: int | None
    triplets: tuple[int, ...]
    n_expanded: int

    @property
    def is_at_goal(self) -> bool:
        """Whether the present state already counts as the goal."""
        return self.level is not None and not self.triplets


class Planner:
    """Finds sequences of experienced actions that lead from a state to a goal.

    It takes a plan of the finest level that has one, with the fewest actions, and of those one that
    ends nearest to the goal (L1). The order of the triplets does not matter.

    Args:
        triplets: the experience.
        abstraction: its levels; :meth:`DynamicAbstraction.fixed` makes it REAL-T's planner.
    """

    def __init__(self, triplets: Triplets, abstraction: DynamicAbstraction) -> None:
        if abstraction.n_variables != triplets.n_variables:
            raise RealBenchError(
                f"the abstraction has {abstraction.n_variables} variables, "
                f"the triplets have {triplets.n_variables}"
            )
        self.triplets, self.abstraction = triplets, abstraction
        self._numbers = np.lexsort(np.hstack([triplets.states, triplets.outcomes]).T[::-1])
        self._states = triplets.states[self._numbers]
        self._outcomes = triplets.outcomes[self._numbers]
        differences = np.abs(self._states - self._outcomes)
        self._longest = float(differences.sum(axis=1).max(initial=0.0))
        self._effective_below = abstraction.effective_below(differences)
        n_kept = max(1, INDEX_BYTES // max(1, self._states.nbytes))
        self._neighbours_at = lru_cache(maxsize=n_kept)(self._index)

    def __deepcopy__(self, memo: object) -> Planner:
        return self  # what it knows never changes, so copies of a controller may share it

    def plan(self, state: ArrayLike, goal: ArrayLike, depth: int = DEPTH) -> Plan:
        """A plan from a state to a goal, both (V,), of at most ``depth`` actions.

        At every level it first checks whether the state already counts as the goal. The last
        outcome of a plan is nearer to the goal (L1) than the state is.
        """
        state_vector, goal_vector = self._vector(state, "state"), self._vector(goal, "goal")
        n_levels = self.abstraction.n_levels
        to_goal = np.abs(self._outcomes - goal_vector)
        gaps = to_goal.sum(axis=1)
        at_goal_level = int(
            self.abstraction.first_same_level(np.abs(state_vector - goal_vector)[None])[0]
        )
        start_levels = self.abstraction.first_same_level(np.abs(self._states - state_vector))
        goal_levels = self.abstraction.first_same_level(to_goal)
        goal_levels[gaps >= np.abs(state_vector - goal_vector).sum()] = n_levels
        n_expanded = 0
        has_both = self._levels_with(start_levels) & self._levels_with(goal_levels)
        for level in np.flatnonzero(has_both[:at_goal_level]).tolist():
            effective = self._effective_below > level
            firsts = np.flatnonzero(effective & (start_levels <= level))
            is_last = effective & (goal_levels <= level)
            path, n = self._search(level, firsts, is_last, gaps, depth)
            n_expanded += n
            if path:
                return Plan(level, tuple(self._numbers[path].tolist()), n_expanded)
        return Plan(at_goal_level if at_goal_level < n_levels else None, (), n_expanded)

    def _levels_with(self, first_same_level: NDArray[np.int64]) -> NDArray[np.bool_]:
        """The levels with an effective action whose state counts as the same there."""
        n_levels = self.abstraction.n_levels
        some = first_same_level < self._effective_below
        begin = np.bincount(first_same_level[some], minlength=n_levels + 1)
        end = np.bincount(self._effective_below[some], minlength=n_levels + 1)
        return np.asarray(np.cumsum(begin - end)[:n_levels] > 0)

    def _search(
        self,
        level: int,
        firsts: NDArray[np.int64],
        is_last: NDArray[np.bool_],
        gaps: NDArray[np.float64],
        depth: int,
    ) -> tuple[list[int], int]:
        """A* at one level; a node is a triplet: after its action the state is its outcome."""
        neighbours = self._neighbours_at(level)
        # No action, from wherever it counts as possible, comes farther than this.
        longest_step = self._longest + float(self.abstraction.thresholds[level].sum())
        return shortest_path(
            firsts,
            is_last,
            gaps / longest_step,
            lambda node: neighbours.find(self._outcomes[node]),
            depth,
        )

    def _index(self, level: int) -> Neighbours:
        effective = np.flatnonzero(self._effective_below > level)
        return Neighbours(self._states, effective, self.abstraction.thresholds[level])

    def _vector(self, values: ArrayLike, name: str) -> NDArray[np.float64]:
        vector = np.asarray(values, np.float64)
        if vector.shape != self._states.shape[1:] or not np.isfinite(vector).all():
            raise RealBenchError(
                f"a {name} must be {self._states.shape[1]} finite numbers, not {vector.tolist()}"
            )
        return vector
