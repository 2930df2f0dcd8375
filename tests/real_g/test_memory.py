from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from real_bench.real_g.hand import Deed
from real_bench.real_g.memory import DeedMemory, aimed, pushed_from
from real_bench.real_g.relation import Relation, turned
from tests.real_g.deeds import DEEDS, HAND, PUSH, drawn, rows


@given(seed=st.integers(0, 1000))
def test_an_action_told_from_an_object_can_be_done_again(seed: int) -> None:
    memory, numbers, row = DeedMemory(Relation(HAND)), drawn(HAND, 1, seed), rows(1, seed)
    again = memory.placed(row[0], memory.told(row, numbers))
    np.testing.assert_allclose(again, numbers, atol=1e-9)


@given(seed=st.integers(0, 1000))
def test_a_push_comes_by_its_object_as_it_is_told(seed: int) -> None:
    random = np.random.default_rng(seed)
    place, ends = random.uniform(-0.2, 0.2, 2), random.uniform(-1, 1, (5, 2))
    offsets = random.uniform(-0.05, 0.05, (5, 2))
    starts = pushed_from(place, offsets, ends)
    way = ends - starts
    angle = np.arctan2(way[:, 1], way[:, 0])
    ahead = np.linalg.norm(ends - place, axis=1) > 0.15
    told = turned(starts - place, -angle)
    np.testing.assert_allclose(told[ahead], offsets[ahead], atol=1e-9)


@pytest.mark.parametrize("deed", DEEDS)
@given(seed=st.integers(0, 200))
def test_whatever_it_thinks_of_is_in_range_and_ends_where_asked(deed: Deed, seed: int) -> None:
    relation, random = Relation(deed), np.random.default_rng(seed)
    memory, numbers, before = DeedMemory(relation, size=5), drawn(deed, 20, seed), rows(20, seed)
    memory.learn(before, numbers, random.random(20))
    ends = drawn(deed, 30, seed + 1)[:, list(deed.end)]
    for thought in (
        memory.varied(before[0], ends, random),
        aimed(relation, before[0], ends, random),
    ):
        assert (thought >= deed.low).all()
        assert (thought <= deed.high).all()
        np.testing.assert_array_equal(thought[:, list(deed.end)], ends)


def test_a_lucky_outcome_among_failures_is_not_kept_before_many_successes() -> None:
    relation, random = Relation(HAND), np.random.default_rng(0)
    good, bad = drawn(HAND, 1, 1), drawn(HAND, 1, 2)
    numbers = np.vstack([np.repeat(good, 20, axis=0), np.repeat(bad, 20, axis=0)])
    numbers += random.normal(size=numbers.shape) * 1e-3
    success = np.append(np.repeat(0.8, 20), np.zeros(20))
    success[-1] = 1.0
    memory = DeedMemory(relation, share=0.5)
    memory.learn(np.tile(rows(1), (40, 1)), numbers, success)
    np.testing.assert_allclose(memory.kept[:, 4:10], np.tile(good[:, 4:10], (20, 1)), atol=0.01)


def test_most_random_actions_for_an_object_begin_near_it() -> None:
    row, ends = np.array([-0.1, 0.1, 0.3]), np.zeros((2000, 2))
    for deed in (HAND, PUSH):
        numbers = aimed(Relation(deed), row, ends, np.random.default_rng(0))
        away = np.linalg.norm(numbers[:, :2] - row[:2], axis=1)
        assert np.median(away) < 0.1 * (deed.high - deed.low)[:2].max()
