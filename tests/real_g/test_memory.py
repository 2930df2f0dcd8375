from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from real_bench.errors import RealBenchError
from real_bench.real_g.hand import Primitive
from real_bench.real_g.memory import ActionMemory, push_starts, sample_near_object
from real_bench.real_g.relation import Relation, rotate
from tests.real_g.deeds import DEEDS, HAND, PUSH, drawn, rows

Array = NDArray[np.float64]


def practised(deed: Primitive, n: int = 100, seed: int = 0) -> ActionMemory:
    """A memory of n random actions, some of which went well."""
    memory, random = ActionMemory(Relation(deed)), np.random.default_rng(seed)
    for row, numbers in zip(rows(n, seed), drawn(deed, n, seed), strict=True):
        memory.record(row, numbers, float(random.random()))
    memory.record(rows(1, seed)[0], drawn(deed, 1, seed + 1)[0], 1.0)
    return memory


@pytest.mark.parametrize("deed", DEEDS)
@given(seed=st.integers(0, 1000))
def test_action_relative_to_an_object_can_be_repeated(deed: Primitive, seed: int) -> None:
    relation, numbers, row = Relation(deed), drawn(deed, 1, seed), rows(1, seed)
    far = np.linalg.norm(numbers[0, list(deed.end)] - row[0, :2]) > 0.2
    again = ActionMemory(relation).absolute(row[0], relation.relative(row, numbers))
    if deed.yaw is not None or (far and _comes_by(relation, row, numbers)):
        np.testing.assert_allclose(again, numbers, atol=1e-9)


def _comes_by(relation: Relation, row: Array, numbers: Array) -> bool:
    """Whether a push's end lies ahead of its object."""
    ahead = rotate(numbers[:, relation.primitive.end] - row[:, :2], -relation.angle(numbers))
    return bool(ahead[0, 0] > 0)


@given(seed=st.integers(0, 1000))
def test_push_passes_its_object_at_the_given_offset(seed: int) -> None:
    random = np.random.default_rng(seed)
    place, ends = random.uniform(-0.2, 0.2, 2), random.uniform(-1, 1, (5, 2))
    offsets = random.uniform(-0.05, 0.05, (5, 2))
    starts = push_starts(place, offsets, ends)
    way = ends - starts
    angle = np.arctan2(way[:, 1], way[:, 0])
    ahead = np.linalg.norm(ends - place, axis=1) > 0.15
    told = rotate(starts - place, -angle)
    np.testing.assert_allclose(told[ahead], offsets[ahead], atol=1e-9)


@pytest.mark.parametrize("deed", DEEDS)
@settings(max_examples=25)
@given(seed=st.integers(0, 200))
def test_proposed_actions_are_in_range_and_go_where_asked(deed: Primitive, seed: int) -> None:
    relation, random = Relation(deed), np.random.default_rng(seed)
    memory, before = practised(deed, seed=seed), rows(1, seed)
    goals = drawn(deed, 30, seed + 1)[:, list(deed.goal)]
    for thought in (
        memory.sample_variations(before[0], goals, random),
        sample_near_object(relation, before[0], goals, random),
    ):
        assert (thought >= deed.low).all()
        assert (thought <= deed.high).all()
        np.testing.assert_array_equal(thought[:, list(deed.goal)], goals)


def test_what_a_goal_leaves_open_is_as_remembered() -> None:
    memory, random, row = ActionMemory(Relation(HAND)), np.random.default_rng(0), rows(1)[0]
    numbers = (HAND.low + HAND.high) / 2
    for _ in range(50):
        memory.record(row, numbers, 0.0)
    memory.record(row, numbers, 1.0)
    goals = np.tile([*numbers[list(HAND.end)], np.nan], (400, 1))
    rise = HAND.goal[2]
    varied = memory.sample_variations(row, goals, random)[:, rise]
    assert np.median(varied) == numbers[rise]
    assert 0.3 < (varied != numbers[rise]).mean() < 0.7
    fresh = sample_near_object(Relation(HAND), row, goals, random)[:, rise]
    assert np.quantile(fresh, [0.1, 0.9]) == pytest.approx([0.1, 0.9], abs=0.06)


def test_actions_that_work_are_kept_and_lucky_ones_given_up() -> None:
    memory, random = ActionMemory(Relation(HAND)), np.random.default_rng(0)
    row, (real, lucky) = rows(1)[0], drawn(HAND, 2, 1)
    for numbers in drawn(HAND, 60, 2):
        memory.record(row, numbers, 0.1)
    memory.record(row, real, 1.0)
    memory.record(row, lucky, 1.0)
    assert len(memory.families) == 2
    for _ in range(200):
        goals = random.uniform(HAND.low, HAND.high, (1, 16))[:, list(HAND.goal)]
        numbers = memory.sample_variations(row, goals, random)[0]
        memory.record(row, numbers, float(_away(numbers, real) < _away(numbers, lucky)))
    goals = np.tile(real[list(HAND.goal)], (200, 1))
    of_real = [
        _away(each, real) < _away(each, lucky)
        for each in memory.sample_variations(row, goals, random)
    ]
    assert np.mean(of_real) > 0.9


def _away(numbers: Array, other: Array) -> float:
    """How unlike two actions are in height and gripper."""
    same = slice(4, 9)
    return float(np.linalg.norm(((numbers - other) / (HAND.high - HAND.low))[same]))


def test_variation_moves_few_numbers_far() -> None:
    deed, random = HAND, np.random.default_rng(0)
    memory = ActionMemory(Relation(deed))
    row, numbers = rows(1)[0], (deed.low + deed.high) / 2
    for _ in range(50):
        memory.record(row, numbers, 0.0)
    memory.record(row, numbers, 1.0)
    goals = np.tile(numbers[list(deed.goal)], (4000, 1))
    shares = (memory.sample_variations(row, goals, random) - deed.low) / (deed.high - deed.low)
    form = [i for i in range(len(numbers)) if i not in {*deed.goal, *deed.start, deed.yaw}]
    for values in shares[:, form].T:
        far = abs(values - np.median(values)) > 0.3
        assert 0 < far.mean() < 0.1
    others = np.sort(abs(shares[:, form] - np.median(shares[:, form], axis=0)), axis=1)
    assert (others[:, :-3] < 0.5).mean() > 0.99  # seldom more than three at once


@pytest.mark.parametrize("deed", DEEDS)
def test_unsurprising_actions_found_no_family(deed: Primitive) -> None:
    memory = ActionMemory(Relation(deed))
    for row, numbers in zip(rows(100), drawn(deed, 100, 0), strict=True):
        memory.record(row, numbers, 0.5)
    assert memory.families == []


@pytest.mark.parametrize("hard", [HAND.end, HAND.goal[2:]], ids=["far", "high"])
def test_what_works_where_all_else_fails_is_kept(hard: tuple[int, ...]) -> None:
    memory, random = ActionMemory(Relation(HAND)), np.random.default_rng(0)
    row, (usual, rare) = rows(1)[0], drawn(HAND, 2, 1)
    asked = list(hard)
    for _ in range(100):
        usual[asked] = HAND.low[asked]
        memory.record(row, usual, float(random.uniform(0.9, 1)))
        usual[asked] = HAND.high[asked]
        memory.record(row, usual, 0.0)
    goal = list(HAND.goal)
    rare[goal] = usual[goal]
    rare[asked] = HAND.low[asked]
    memory.record(row, rare, 0.5)  # others do better there
    assert not any(_away(family.founder, _relative(row, rare)) == 0 for family in memory.families)
    rare[asked] = HAND.high[asked]
    memory.record(row, rare, 0.5)
    varied = memory.sample_variations(row, np.tile(rare[goal], (200, 1)), random)
    assert np.mean([_away(each, rare) < _away(each, usual) for each in varied]) > 0.7


def test_family_keeps_members_of_rare_situations() -> None:
    memory = ActionMemory(Relation(HAND), n_members=20)
    row, numbers = rows(1)[0], drawn(HAND, 1, 1)[0]
    near, far = HAND.low[list(HAND.end)], HAND.high[list(HAND.end)]
    for success in (*[0.0] * 50, 1.0):
        numbers[list(HAND.end)] = near
        memory.record(row, numbers, success)
    numbers[list(HAND.end)] = far
    memory.record(row, numbers, 0.7)
    numbers[list(HAND.end)] = near
    for _ in range(200):
        memory.record(row, numbers, 0.1)
    (family,) = memory.families
    assert len(family.members) == 20
    assert family.successes.count(0.7) == 1


def _relative(row: Array, numbers: Array) -> Array:
    relative: Array = Relation(HAND).relative(row[None], numbers[None])[0]
    return relative


@pytest.mark.parametrize("deed", DEEDS)
def test_state_restores_the_families(deed: Primitive) -> None:
    memory, again = practised(deed), ActionMemory(Relation(deed))
    again.set_state(memory.get_state())
    row, goals = rows(1)[0], drawn(deed, 20, 3)[:, list(deed.goal)]
    one, other = (
        each.sample_variations(row, goals, np.random.default_rng(1)) for each in (memory, again)
    )
    np.testing.assert_array_equal(one, other)


def test_empty_memory_cannot_vary_actions() -> None:
    with pytest.raises(RealBenchError, match="nothing went well yet"):
        ActionMemory(Relation(PUSH)).sample_variations(
            rows(1)[0], np.zeros((1, 2)), np.random.default_rng(0)
        )


def test_numbers_of_families_and_members_are_limited() -> None:
    memory = ActionMemory(Relation(PUSH), max_families=3, n_members=5, like=0.6)
    random = np.random.default_rng(0)
    for row, numbers in zip(rows(500), drawn(PUSH, 500, 0), strict=True):
        memory.record(row, numbers, float(random.random()))
    assert len(memory.families) == 3
    assert max(len(family.members) for family in memory.families) == 5


def test_most_random_actions_for_an_object_begin_near_it() -> None:
    row = np.array([-0.1, 0.1, 0.3])
    for deed in (HAND, PUSH):
        goals = np.zeros((2000, len(deed.goal)))
        numbers = sample_near_object(Relation(deed), row, goals, np.random.default_rng(0))
        away = np.linalg.norm(numbers[:, :2] - row[:2], axis=1)
        assert np.median(away) < 0.1 * (deed.high - deed.low)[:2].max()
