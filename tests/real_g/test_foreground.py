from __future__ import annotations

import copy

import numpy as np
import pytest

from real_bench.errors import RealBenchError
from real_bench.real_g.foreground import MAX_KEPT, Foreground
from tests.real_g.pictures import BLUE, RED, SIDE, painted


def looked_at(places: np.ndarray, colours: tuple[tuple[int, int, int], ...]) -> Foreground:
    foreground = Foreground(np.random.default_rng(0))
    for row in places:
        foreground.add(painted(row, colours))
    foreground.learn()
    return foreground


def scattered(n: int, k: int = 1, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).integers(20, 200, (n, k, 2)).astype(float)


def test_only_what_moves_is_marked() -> None:
    places = scattered(12)
    marked = looked_at(places, (RED,)).mask(painted(places[5], (RED,)))
    column, row = places[5, 0].astype(int)
    expected = np.zeros((240, 320), bool)
    expected[row : row + SIDE, column : column + SIDE] = True
    np.testing.assert_array_equal(marked, expected)


def test_objects_are_background_until_they_move() -> None:
    places = scattered(12, 2)
    places[:, 1] = 210  # a blue thing that nobody moves
    foreground = looked_at(places, (RED, BLUE))
    assert not foreground.mask(painted(places[3], (RED, BLUE)))[205:].any()
    moved = places[3].copy()
    moved[1] = 20, 180
    assert foreground.mask(painted(moved, (RED, BLUE)))[185, 25]


def test_image_like_the_last_one_is_not_added() -> None:
    foreground = Foreground(np.random.default_rng(0))
    image = painted(scattered(1)[0], (RED,))
    assert foreground.add(image)
    assert not foreground.add(image)


def test_number_of_kept_images_is_limited() -> None:
    foreground = looked_at(scattered(MAX_KEPT + 40), (RED,))
    assert len(foreground._kept) == MAX_KEPT


def test_state_restores_the_background_and_copies_are_independent() -> None:
    places = scattered(12)
    foreground = looked_at(places, (RED,))
    heir, twin = Foreground(np.random.default_rng(0)), copy.deepcopy(foreground)
    heir.set_state(foreground.get_state())
    image = painted(places[7], (RED,))
    for other in (heir, twin):
        np.testing.assert_array_equal(other.mask(image), foreground.mask(image))
    twin.add(painted(scattered(1, seed=9)[0], (BLUE,)))
    assert len(twin._kept) == len(foreground._kept) + 1


def test_without_images_there_is_no_background() -> None:
    foreground = Foreground(np.random.default_rng(0))
    assert not foreground.is_known
    with pytest.raises(RealBenchError, match="no background"):
        foreground.mask(painted(scattered(1)[0], (RED,)))
