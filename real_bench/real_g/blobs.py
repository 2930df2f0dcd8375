"""Patches of an image that show things, and what they look like."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from real_bench.real_g.arrays import Array

SHADES = 6
"""Levels that are distinguished in each colour."""

N_COLOURS = SHADES**3

MIN_PIXELS = 6
"""A smaller patch has no shape."""

NEIGHBOURHOOD = 5
"""Side of the square of pixels that are assigned together."""


@dataclass(frozen=True)
class Blob:
    """A patch.

    Attributes:
        position: column and row of its middle, (2,) pixels.
        size: how many pixels it has.
        axis: the direction of its longer axis, radians from the columns' direction to the rows',
            within half a turn.
        elongation: its length divided by its width.
        colours: the share of each colour, (N_COLOURS,).
    """

    position: Array
    size: int
    axis: float
    elongation: float
    colours: Array


def find_blobs(image: NDArray[np.uint8], mask: NDArray[np.bool_]) -> list[Blob]:
    """The connected patches of marked pixels, the largest first.

    Args:
        image: (height, width, 3).
        mask: (height, width).
    """
    n, labels, boxes, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    blobs = []
    for label in range(1, n):
        left, top, width, height, size = boxes[label].tolist()
        if size >= MIN_PIXELS:
            window = (slice(top, top + height), slice(left, left + width))
            blobs.append(_blob(image[window], labels[window] == label, left, top))
    return sorted(blobs, key=lambda blob: -blob.size)


def split_blobs(
    image: NDArray[np.uint8], mask: NDArray[np.bool_], appearances: Array
) -> list[Blob | None]:
    """For each look the largest patch where it is the likeliest; separates touching things.

    Args:
        image: (height, width, 3).
        mask: (height, width).
        appearances: for each thing how likely a pixel of it has each colour, (k, N_COLOURS).

    Returns:
        k patches; None for a look that is nowhere the likeliest.
    """
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return [None] * len(appearances)
    top, left = int(rows[0]), int(columns[0])
    window = (slice(top, int(rows[-1]) + 1), slice(left, int(columns[-1]) + 1))
    image, mask = image[window], mask[window]
    support = np.log(appearances)[:, colours_of(image)] * mask
    side = (NEIGHBOURHOOD, NEIGHBOURHOOD)
    blurred = np.array([cv2.boxFilter(part, -1, side, normalize=False) for part in support])
    assigned = np.where(mask, blurred.argmax(axis=0), -1)
    found: list[Blob | None] = []
    for k in range(len(appearances)):
        blobs = find_blobs(image, assigned == k)
        found.append(_shifted(blobs[0], left, top) if blobs else None)
    return found


def colours_of(pixels: NDArray[np.uint8]) -> NDArray[np.intp]:
    """The number of each pixel's colour, (..., 3) to (...)."""
    levels = pixels.astype(np.intp) * SHADES // 256
    return np.asarray((levels[..., 0] * SHADES + levels[..., 1]) * SHADES + levels[..., 2])


def _blob(image: NDArray[np.uint8], inside: NDArray[np.bool_], left: int, top: int) -> Blob:
    rows, columns = np.nonzero(inside)
    points = np.column_stack([columns, rows]).astype(np.float64)
    position = points.mean(axis=0)
    spread, axes = np.linalg.eigh(
        np.cov(points.T, bias=True) + np.eye(2) / 12
    )  # a pixel has a width, too
    counts = np.bincount(colours_of(image[rows, columns]), minlength=N_COLOURS)
    return Blob(
        position=position + np.array([left, top]),
        size=len(points),
        axis=float(np.arctan2(axes[1, 1], axes[0, 1]) % np.pi),
        elongation=float(np.sqrt(spread[1] / spread[0])),
        colours=counts / len(points),
    )


def _shifted(blob: Blob, left: int, top: int) -> Blob:
    return Blob(
        blob.position + np.array([left, top]), blob.size, blob.axis, blob.elongation, blob.colours
    )
