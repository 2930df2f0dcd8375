"""A painted table with painted things, to look at."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

RED, BLUE, GREEN = (180, 20, 10), (20, 30, 170), (20, 150, 40)
SIDE = 14


def table(seed: int = 0) -> Image:
    """A grainy brown plane, (240, 320, 3)."""
    grain = np.random.default_rng(seed).integers(0, 30, (240, 320, 1))
    return np.asarray(grain + np.array([150, 130, 90]), np.uint8)


def painted(places: Array, colours: tuple[tuple[int, int, int], ...], side: int = SIDE) -> Image:
    """The table with a square thing at each (column, row) of its first pixel; NaN: none."""
    image = table()
    for (column, row), colour in zip(places, colours, strict=True):
        if not np.isnan(column):
            image[int(row) : int(row) + side, int(column) : int(column) + side] = colour
    return image
