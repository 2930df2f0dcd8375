"""Where the robot's own hand is in an image, learned by moving the gripper alone.

Pixels that are nearer than they are with the gripper open show the closed gripper. Of each colour
of the arm the share of such pixels is counted; the colours that are often of the gripper are the
hand's. The arm sways when the gripper moves, so every colour has some; a posture in which most of
the arm moves does not count.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from real_bench.real_g.arrays import Array, Image
from real_bench.real_g.blobs import N_COLOURS, colours_of
from real_bench.real_g.ground import MAX_DEPTH

NEARER = 0.01
"""Something stands before something else if it is nearer by this share of the ground's distance."""

MAX_SWAY = 0.5
"""The arm sways if more than this share of its pixels moves."""

MIN_GRIPPER_SHARE = 0.45
"""The share of a colour's pixels that move with the gripper, if it is the hand's."""

RARE = 50
"""Colours need more pixels than this many that did not move."""

MIN_PIXELS = 8
"""Fewer pixels of its colours are no hand."""

LOWEST_SHARE = 0.3
"""The hand is where this share of its pixels is that is the lowest."""


class HandSight:
    """Finds the lowest part of the hand: x, y, distance in shares of the ground's distance.

    x and y are in the plane across the camera's axis, in units of half the image's width as seen on
    the ground.

    Args:
        depth: a depth buffer with nothing but the ground, (height, width) in 0..1.
    """

    def __init__(self, depth: NDArray[Any]) -> None:
        self._background = np.asarray(depth, np.float32)
        near = 1 / (1 - np.minimum(self._background, MAX_DEPTH))
        ground = self._background < MAX_DEPTH
        self.unit = float(np.median(near[ground])) if ground.any() else 1.0
        self._ground = near / self.unit
        self._seen, self._moved = np.zeros(N_COLOURS), np.zeros(N_COLOURS)

    @property
    def colours(self) -> NDArray[np.bool_]:
        """Which colours are the hand's, (N_COLOURS,)."""
        return np.asarray(self._moved / (self._seen + RARE) > MIN_GRIPPER_SHARE)

    @property
    def image_map(self) -> Array:
        """From offsets from the middle of the image times the distance to x, y, (3, 2), affine."""
        scale = 1 / (self._ground.shape[1] / 2 * self.unit)
        return np.array([[0.0, 0.0], [scale, 0.0], [0.0, scale]])

    def ground_points(self, step: int) -> Array:
        """Points of the ground, (n, 3), from every ``step``-th pixel and row."""
        rows, columns = np.nonzero(self._background[::step, ::step] < MAX_DEPTH)
        distance = self._ground[rows * step, columns * step]
        return self.points(np.column_stack([columns, rows]) * float(step), distance)

    def points(self, pixels: NDArray[Any], distance: NDArray[Any]) -> Array:
        """Points at columns and rows, (n, 2), at distances, (n,): (n, 3)."""
        height, width = self._ground.shape
        middle = np.array([width / 2, height / 2])
        across = (pixels - middle) / (width / 2) * distance[:, None]
        return np.column_stack([across, distance]).astype(np.float64)

    def compare(self, image: Image, closed: NDArray[Any], wide: NDArray[Any]) -> None:
        """Learn colours from one posture seen twice, unless the arm sways.

        Args:
            image: with the gripper closed, (height, width, 3).
            closed: its depth buffer, (height, width).
            wide: that with the gripper open.
        """
        one, other = self._distance(closed), self._distance(wide)
        arm = self._ground - one > 2 * NEARER
        moves = arm & (other - one > NEARER)
        if moves.sum() > MAX_SWAY * arm.sum():
            return
        colours = colours_of(image)
        self._seen = self._seen + np.bincount(colours[arm], minlength=N_COLOURS)
        self._moved = self._moved + np.bincount(colours[moves], minlength=N_COLOURS)

    def find(self, image: Image, depth: NDArray[Any]) -> Array | None:
        """The lowest part of the largest patch of the hand, (3,); None if it is not seen."""
        distance = self._distance(depth)
        mask = (self._ground - distance > NEARER) & self.colours[colours_of(image)]
        _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
        sizes = stats[1:, cv2.CC_STAT_AREA]
        if sizes.max(initial=0) < MIN_PIXELS:
            return None
        rows, columns = np.nonzero(labels == 1 + sizes.argmax())
        far = distance[rows, columns]
        low = far >= np.quantile(far, 1 - LOWEST_SHARE)
        middle = np.array([[columns[low].mean(), rows[low].mean()]])
        return np.asarray(self.points(middle, np.array([far[low].mean()]))[0])

    def get_state(self) -> dict[str, Any]:
        """The ground and what was counted."""
        return {"depth": self._background, "seen": self._seen, "moved": self._moved}

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> HandSight:
        """Go on from there."""
        sight = cls(np.asarray(state["depth"]))
        sight._seen = np.asarray(state["seen"], np.float64)
        sight._moved = np.asarray(state["moved"], np.float64)
        return sight

    def _distance(self, depth: NDArray[Any]) -> NDArray[np.float32]:
        near = 1 / (1 - np.minimum(np.asarray(depth, np.float32), MAX_DEPTH))
        return np.asarray(near / self.unit, np.float32)
