"""Which goals to test when only a part of a set is tested."""

from __future__ import annotations

from collections.abc import Sequence

from real_bench.goal_sets.goal import CHALLENGES


def goals_in_proportion(classes: Sequence[str], n_goals: int) -> tuple[int, ...]:
    """The numbers of ``n_goals`` goals, each class in proportion.

    They depend on nothing else, and a smaller selection is part of every larger one: a test of
    five goals can continue to ten. Each goal of a class stands for an equal share of it, and goals
    are taken in the order of the middles of their shares; ties go to the paper's first class, then
    to the lower number.

    Args:
        classes: of every goal of the set.
        n_goals: how many.

    Returns:
        Ascending numbers, from 0.
    """
    before = dict.fromkeys(CHALLENGES, 0)
    order = []
    for number, name in enumerate(classes):
        middle = (before[name] + 0.5) / classes.count(name)
        order.append((middle, CHALLENGES.index(name), number))
        before[name] += 1
    return tuple(sorted(number for _, _, number in sorted(order)[:n_goals]))
