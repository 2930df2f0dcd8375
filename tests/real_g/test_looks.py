from __future__ import annotations

import copy
import functools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from real_bench.real_g.blobs import Blob, find_blobs
from real_bench.real_g.looks import Appearances
from tests.real_g.pictures import BLUE, GREEN, RED, painted, table

COLOURS = (RED, BLUE, GREEN)


def blobs_at(places: np.ndarray) -> list[Blob]:
    image = painted(places, COLOURS)
    return find_blobs(image, (image != table()).any(axis=2))


def apart(n: int, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    return np.stack([random.integers(low, low + 50, (n, 2)) for low in (10, 90, 170)], axis=1)


@functools.cache
def few_blobs() -> list[list[Blob]]:
    return [blobs_at(places) for places in apart(20, 0)]


@functools.cache
def lessons() -> Appearances:
    looks = Appearances()
    looks.learn(few_blobs())
    return looks


def learned() -> Appearances:
    return copy.deepcopy(lessons())


def test_objects_are_counted() -> None:
    assert len(learned()) == 3


@settings(max_examples=40)
@given(seed=st.integers(1, 1000), order=st.permutations(range(3)))
def test_objects_keep_their_order_wherever_they_are(seed: int, order: list[int]) -> None:
    looks = learned()
    places = apart(1, seed)[0]
    first = looks.assign(blobs_at(apart(1, 0)[0]))
    found = looks.assign([blobs_at(places)[k] for k in order])
    assert None not in found
    for one, other in zip(first, found, strict=True):
        assert one is not None
        assert other is not None
        np.testing.assert_allclose(one.colours, other.colours)


def test_learning_more_keeps_the_order() -> None:
    looks = learned()
    before = looks.likelihoods
    looks.learn([blobs_at(places) for places in apart(30, 5)])
    np.testing.assert_allclose(looks.likelihoods, before)


def test_unseen_object_is_missing() -> None:
    looks = learned()
    blobs = blobs_at(apart(1, 0)[0])
    found = looks.assign(blobs[:2])
    assert sum(thing is None for thing in found) == 1
    assert looks.may_be_merged(blobs[:2])
    assert not looks.may_be_merged(blobs)


def test_restored_looks_sort_blobs_the_same() -> None:
    looks, heir = learned(), Appearances()
    heir.set_state(looks.get_state())
    blobs = blobs_at(apart(1, 3)[0])
    for one, other in zip(looks.assign(blobs), heir.assign(blobs), strict=True):
        assert one is other


def test_nothing_is_learned_without_blobs() -> None:
    looks = Appearances()
    looks.learn([[], []])
    assert len(looks) == 0
    assert looks.assign([]) == []
