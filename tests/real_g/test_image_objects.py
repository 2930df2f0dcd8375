from __future__ import annotations

import copy
from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from real_bench.real_g.image_objects import ImageObjects
from tests.real_g.pictures import BLUE, RED, SIDE, painted

Array = NDArray[np.float64]

LOW, HIGH = np.array([-0.25, -0.5]), np.array([0.25, 0.5])
METRES_A_PIXEL = 0.005
DISTANCE = 8.0


def xy_of(pixels: Array) -> Array:
    """Where the middle of a thing is whose first pixel is there: rows are x, columns y."""
    return (pixels[..., ::-1] + (SIDE - 1) / 2 - [120, 160]) * METRES_A_PIXEL


def pixels_of(xy: Array) -> Array:
    return np.round(xy / METRES_A_PIXEL + [120, 160] - (SIDE - 1) / 2)[..., ::-1]


def play(n: int, seed: int = 0) -> Iterator[tuple[Array, Array]]:
    """Pixels of two things, and the path of the hand that pushes those on its way."""
    random = np.random.default_rng(seed)
    places = np.array([[-0.1, -0.2], [0.1, 0.2]])
    for _ in range(n):
        path = random.uniform(LOW, HIGH, (2, 2))
        yield pixels_of(places), path
        way = path[1] - path[0]
        for k, place in enumerate(places):
            share = np.clip((place - path[0]) @ way / (way @ way), 0, 1)
            if np.linalg.norm(path[0] + share * way - place) < 0.05:
                places[k] = path[1] + random.normal(0, 0.01, 2)
        if np.linalg.norm(places[0] - places[1]) < 0.1:
            places[1] = random.uniform(LOW, HIGH)
        places = np.clip(places, LOW + 0.04, HIGH - 0.04)


def played(n: int = 200) -> tuple[ImageObjects, Array]:
    objects = ImageObjects(LOW, HIGH)
    depth = np.full((240, 320), 1 - 1 / DISTANCE)
    truth = []
    for pixels, path in play(n):
        objects.see(painted(pixels, (RED, BLUE)), depth)
        objects.act(path)
        truth.append(xy_of(pixels))
    return objects, np.array(truth)


@pytest.fixture(scope="module")
def learned() -> tuple[ImageObjects, Array]:
    objects, truth = played()
    assert objects.n_objects == 2
    return objects, truth


def order_of(rows: Array, truth: Array) -> list[int]:
    away = np.linalg.norm(rows[-1, :, None, :2] - truth[-1], axis=2)
    return [int(k) for k in away.argmin(axis=1)]


def test_each_object_is_seen_where_it_is(learned: tuple[ImageObjects, Array]) -> None:
    objects, truth = learned
    rows = objects.rows()
    assert rows.shape == (len(truth), 2, 3)
    errors = np.linalg.norm(rows[:, :, :2] - truth[:, order_of(rows, truth)], axis=2)
    assert np.median(errors) < 0.015
    assert np.quantile(errors, 0.95) < 0.03


def test_rows_from_a_moment_on_are_the_last_of_all_rows(
    learned: tuple[ImageObjects, Array],
) -> None:
    objects, truth = learned
    for first in (0, 17, len(truth) - 1):
        np.testing.assert_array_equal(objects.rows(first), objects.rows()[first:])


def test_new_image_is_read_like_those_of_the_play(learned: tuple[ImageObjects, Array]) -> None:
    objects, truth = learned
    pixels = pixels_of(np.array([[0.0, 0.0], [0.12, -0.3]]))
    rows = objects.look(painted(pixels, (RED, BLUE)))
    order = order_of(objects.rows(), truth)
    np.testing.assert_allclose(rows[:, :2], xy_of(pixels)[order], atol=0.03)


def test_object_missing_from_an_image_has_no_place(learned: tuple[ImageObjects, Array]) -> None:
    objects, truth = learned
    pixels = pixels_of(np.array([[0.0, 0.0], [np.nan, np.nan]]))
    seen = ~np.isnan(objects.look(painted(pixels, (RED, BLUE)))).any(axis=1)
    assert seen.tolist() == [k == 0 for k in order_of(objects.rows(), truth)]


def test_remembered_play_teaches_the_same_as_a_lived_one(
    learned: tuple[ImageObjects, Array],
) -> None:
    lived = copy.deepcopy(learned[0])
    lived.learn()
    heir = ImageObjects(LOW, HIGH)
    heir.set_state(lived.get_state())
    heir.forget()
    for pixels, path in play(len(learned[1])):
        heir.remember(painted(pixels, (RED, BLUE)))
        heir.act(path)
    heir.learn()
    np.testing.assert_allclose(heir.rows(), lived.rows(), atol=0.005)


def test_state_and_copy_see_the_same(learned: tuple[ImageObjects, Array]) -> None:
    objects = learned[0]
    heir = ImageObjects(LOW, HIGH)
    heir.set_state(objects.get_state())
    image = painted(pixels_of(np.array([[0.05, 0.1], [-0.1, -0.3]])), (RED, BLUE))
    for other in (heir, copy.deepcopy(objects)):
        np.testing.assert_array_equal(other.look(image), objects.look(image))


def test_copy_has_a_memory_of_its_own(learned: tuple[ImageObjects, Array]) -> None:
    objects, truth = learned
    twin = copy.deepcopy(objects)
    twin.see(painted(pixels_of(np.array([[0.0, 0.3], [0.1, 0.0]])), (RED, BLUE)))
    assert len(twin.rows()) == len(truth) + 1
    assert len(objects.rows()) == len(truth)


def test_the_same_seed_learns_the_same(learned: tuple[ImageObjects, Array]) -> None:
    np.testing.assert_array_equal(played()[0].rows(), learned[0].rows())


def test_hidden_moment_repeats_the_one_before(
    learned: tuple[ImageObjects, Array],
) -> None:
    objects = copy.deepcopy(learned[0])
    objects.see(None)
    assert not objects.changed()
    np.testing.assert_array_equal(objects.rows()[-1], objects.rows()[-2])


def test_no_object_is_known_before_anything_moved() -> None:
    objects = ImageObjects(LOW, HIGH)
    image = painted(pixels_of(np.array([[0.0, 0.3], [0.1, 0.0]])), (RED, BLUE))
    objects.see(None)
    for _ in range(5):
        objects.see(image)
        objects.act(np.array([[0.1, 0.1], [0.2, 0.2]]))
    assert objects.n_objects == 0
    assert objects.rows().shape == (6, 0, 3)
    assert objects.look(image).shape == (0, 3)


def resized(pixels: Array, width: int, height: int) -> NDArray[np.uint8]:
    image = painted(pixels, (RED, BLUE))
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_NEAREST), np.uint8)


@pytest.mark.parametrize("share", [0.5, 2.0])
def test_rows_do_not_depend_on_how_large_images_are(
    learned: tuple[ImageObjects, Array], share: float
) -> None:
    """A camera of another resolution sees the same things at the same places."""
    height, width = int(240 * share), int(320 * share)
    objects = ImageObjects(LOW, HIGH)
    depth = np.full((height, width), 1 - 1 / DISTANCE)
    for pixels, path in play(len(learned[1])):
        objects.see(resized(pixels, width, height), depth)
        objects.act(path)
    rows, truth = objects.rows(), learned[1]
    assert rows.shape == (len(truth), 2, 3)
    errors = np.linalg.norm(rows[:, :, :2] - truth[:, order_of(rows, truth)], axis=2)
    assert np.median(errors) < 0.015
    np.testing.assert_allclose(rows[:, :, 2].mean(), learned[0].rows()[:, :, 2].mean(), rtol=0.1)


@pytest.mark.parametrize("share", [0.5, 1.0, 2.0])
def test_a_given_map_serves_images_of_any_size(share: float) -> None:
    """The middle of the image is where a map without an offset says 0, 0."""
    height, width = int(240 * share), int(320 * share)
    scale = METRES_A_PIXEL / share / DISTANCE
    objects = ImageObjects(LOW, HIGH, np.array([[0.0, 0.0], [0.0, scale], [scale, 0.0]]))
    depth = np.full((height, width), 1 - 1 / DISTANCE)
    for pixels, path in play(40):
        objects.see(resized(pixels, width, height), depth)
        objects.act(path)
    pixels = pixels_of(np.array([[0.0, 0.0], [0.12, -0.3]]))
    found = objects.look(resized(pixels, width, height))[:, :2]
    away = np.linalg.norm(found[:, None] - xy_of(pixels), axis=2)
    assert away.min(axis=1).max() < 0.01
