from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from real_bench.goal_sets import CHALLENGES, goals_in_proportion, load_goal_set, shipped_goal_set

CLASSES = st.lists(st.sampled_from(CHALLENGES), min_size=1, max_size=60)


@given(CLASSES, st.data())
def test_a_part_has_all_classes_in_proportion(classes: list[str], data: st.DataObject) -> None:
    n_goals = data.draw(st.integers(1, len(classes)))
    part = goals_in_proportion(classes, n_goals)
    assert len(set(part)) == n_goals
    assert list(part) == sorted(part)
    for name in set(classes):
        share = classes.count(name) / len(classes)
        taken = [classes[number] for number in part].count(name)
        assert abs(taken - share * n_goals) <= 0.5 + 1.5 * share


@given(CLASSES)
def test_smaller_parts_are_subsets_of_larger_ones(classes: list[str]) -> None:
    parts = [set(goals_in_proportion(classes, n)) for n in range(1, len(classes) + 1)]
    assert all(one < other for one, other in pairwise(parts))
    assert parts[-1] == set(range(len(classes)))


def test_parts_of_the_shipped_goals_have_expected_counts() -> None:
    classes = load_goal_set(shipped_goal_set(1)).classes
    for n_goals, counts in ((5, (3, 1, 1)), (10, (5, 3, 2)), (20, (10, 6, 4)), (50, (25, 15, 10))):
        part = [classes[number] for number in goals_in_proportion(classes, n_goals)]
        assert tuple(map(part.count, CHALLENGES)) == counts
