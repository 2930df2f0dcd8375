from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from real_bench.real_g.blobs import N_COLOURS, colours_of, find_blobs, split_blobs
from tests.real_g.pictures import BLUE, RED, SIDE, painted, table


@given(
    column=st.integers(0, 250),
    row=st.integers(0, 200),
    across=st.integers(3, 40),
    down=st.integers(3, 30),
)
def test_blob_has_the_place_size_and_shape_of_its_patch(
    column: int, row: int, across: int, down: int
) -> None:
    marked = np.zeros((240, 320), bool)
    marked[row : row + down, column : column + across] = True
    (blob,) = find_blobs(table(), marked)
    np.testing.assert_allclose(blob.position, [column + (across - 1) / 2, row + (down - 1) / 2])
    assert blob.size == across * down
    longer, broad = max(across, down), min(across, down)
    np.testing.assert_allclose(blob.elongation, longer / broad)
    if across != down:
        upright = abs(np.sin(blob.axis)) > 0.5
        assert upright == (down > across)


def test_largest_blob_comes_first_and_specks_are_ignored() -> None:
    marked = np.zeros((240, 320), bool)
    marked[10:20, 10:20] = marked[50:90, 50:90] = True
    marked[200, 200] = True
    assert [blob.size for blob in find_blobs(table(), marked)] == [1600, 100]


def test_touching_objects_are_split_by_colour() -> None:
    places = np.array([[100, 100], [100 + SIDE, 104]])
    image = painted(places, (RED, BLUE))
    marked = (image != table()).any(axis=2)
    looks = np.full((2, N_COLOURS), 1e-4)
    for look, colour in zip(looks, (RED, BLUE), strict=True):
        look[colours_of(np.array(colour, np.uint8))] = 1
    (merged,) = find_blobs(image, marked)
    assert merged.size == 2 * SIDE**2
    for part, place in zip(split_blobs(image, marked, looks), places, strict=True):
        assert part is not None
        np.testing.assert_allclose(part.position, place + (SIDE - 1) / 2, atol=1.5)


def test_split_finds_nothing_in_an_empty_mask() -> None:
    marked = np.zeros((240, 320), bool)
    assert split_blobs(table(), marked, np.ones((2, N_COLOURS))) == [None, None]
