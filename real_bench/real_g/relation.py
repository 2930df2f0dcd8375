"""An action relative to an object: where the hand arrives, how it is turned, where it goes.

Everything is in the hand's frame (its turn, or a push's direction if it has none), so that what is
learned at one place holds at every other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from real_bench.real_g.hand import Deed

Array = NDArray[np.float64]


class Relation:
    """Turns objects' rows and actions' numbers into what a model learns from.

    A row is x, y, z of an object, and its quaternion if known. An outcome is relative to having
    followed the hand: 0, 0 if the object followed.

    Args:
        deed: the form of the actions.
    """

    def __init__(self, deed: Deed) -> None:
        self.deed = deed
        places = {*deed.start, *deed.end, deed.turn}
        self._fine = FINE * float((deed.high - deed.low)[list(deed.start)].mean())
        self._others = [i for i in range(len(deed.low)) if i not in places]

    def features(self, rows: Array, numbers: Array) -> Array:
        """Features of n actions on an object, (n, F).

        Args:
            rows: the object before each, (n, 3 or 7).
            numbers: the actions', (n, P).
        """
        deed, angle = self.deed, self.angle(numbers)
        told = self.told(rows, numbers)
        offset, others = told[:, deed.start], told[:, self._others]
        way = self.way(numbers)
        parts = [
            offset,
            np.arcsinh(offset / self._fine),
            rows[:, :3],
            turned(way, -angle),
            way,
            numbers[:, deed.end],
            np.column_stack([np.sin(angle), np.cos(angle), np.linalg.norm(way, axis=1)]),
            others,
        ]
        if rows.shape[1] == 7:
            parts.append(orientation(rows[:, 3:], angle))
        return np.concatenate(parts, axis=1)

    def told(self, rows: Array, numbers: Array) -> Array:
        """Actions' numbers, (n, P), start and height relative to the object, in hand's frame."""
        deed, told = self.deed, numbers.copy()
        told[:, deed.start] = turned(numbers[:, deed.start] - rows[:, :2], -self.angle(numbers))
        if deed.height is not None:
            told[:, deed.height] -= rows[:, 2]
        return told

    def angle(self, numbers: Array) -> Array:
        """The frame's turn about the vertical, (n,) radians."""
        if self.deed.turn is not None:
            return numbers[:, self.deed.turn]
        way = self.way(numbers)
        return np.asarray(np.arctan2(way[:, 1], way[:, 0]))

    def way(self, numbers: Array) -> Array:
        """How far the hand goes, (n, 2)."""
        return np.asarray(numbers[:, self.deed.end] - numbers[:, self.deed.start])

    def outcome(self, before: Array, after: Array, numbers: Array) -> Array:
        """Outcomes of n actions, (n, 3): x, y in the frame relative to having followed; z.

        Args:
            before: rows of the object, (n, 3 or 7).
            after: its rows after each.
            numbers: the actions', (n, P).
        """
        left = after[:, :2] - before[:, :2] - self.way(numbers)
        return np.column_stack([turned(left, -self.angle(numbers)), after[:, 2] - before[:, 2]])

    def ends(self, before: Array, outcomes: Array, numbers: Array) -> Array:
        """Where objects end, (n, ..., 3), by (n, ..., 3) outcomes of n actions."""
        extra = outcomes.ndim - 2
        angle = self.angle(numbers).reshape(-1, *[1] * extra)
        start = np.concatenate([before[:, :2] + self.way(numbers), before[:, 2:3]], axis=1)
        start = start.reshape(len(before), *[1] * extra, 3)
        flat = turned(outcomes[..., :2], angle)
        return np.asarray(start + np.concatenate([flat, outcomes[..., 2:]], axis=-1))

    def stays(self, numbers: Array) -> Array:
        """The outcome of actions that move nothing, (n, 3)."""
        way = turned(-self.way(numbers), -self.angle(numbers))
        return np.column_stack([way, np.zeros(len(way))])

    def contingency(self, before: Array, after: Array, numbers: Array) -> Array:
        """How much the object followed the hand, (n,).

        1 if it moved by the same vector, 0 if it is no nearer to that than by staying.
        """
        left = after[:, :2] - before[:, :2] - self.way(numbers)
        return following(np.linalg.norm(left, axis=1), np.linalg.norm(self.way(numbers), axis=1))


FINE = 0.03
"""Offsets are given twice: once scaled to resolve those below this share of the range."""

SHARP = 3
"""Power of the share followed: following all the way is worth much more than in part."""


def following(left: Array, way: Array) -> Array:
    """1 if nothing is left of the hand's way, 0 if all of it is left, or more."""
    return np.clip(1 - left / np.maximum(way, np.finfo(float).tiny), 0.0, 1.0) ** SHARP


def turned(vectors: Array, angle: Array) -> Array:
    """Vectors (..., 2) turned by angles that fit (...)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def orientation(quaternions: Array, angle: Array) -> Array:
    """Orientations of bodies in frames, (n, 11), invariant to half a turn of a body.

    For each of its three axes the double angle in the plane and the height; for all three the
    fourfold angle, which is the same for a body with four equal sides.
    """
    x, y, z, w = quaternions.T
    axes = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
            [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
            [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
        ]
    )  # axis, coordinate, body
    flat = (axes[:, 0] + 1j * axes[:, 1]) * np.exp(-1j * angle)
    twofold, fourfold = flat**2, (flat**4).sum(axis=0)
    return np.column_stack(
        [*twofold.real, *twofold.imag, *axes[:, 2] ** 2, fourfold.real, fourfold.imag]
    )
