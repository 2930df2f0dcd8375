"""Which goals are tested where not all of a set are."""

from __future__ import annotations

from collections.abc import Sequence

from real_bench.goal_sets.goal import CHALLENGES


def goals_in_proportion(classes: Sequence[str], n_goals: int) -> tuple[int, ...]:
    """The numbers of so many goals, of all classes in proportion.

    They depend on nothing else, and fewer are always some of more: a test of five goals goes on to
    ten. Each goal of a class stands for an equal share of it, and the goals whose shares have their
    middle first are taken first; of those that tie, the paper's first class, then the lower number.

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
