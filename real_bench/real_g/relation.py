"""An action as an object sees it: where the hand comes, how it is turned, where it goes.

All is told in the hand's frame (its turn; a push's direction where it has none), so that what was
learned at one place is known at every other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from real_bench.real_g.hand import Deed

Array = NDArray[np.float64]


class Relation:
    """Turns objects' rows and actions' numbers into what a model learns from.

    A row is x, y, z of an object, and its quaternion where it is known. An outcome is told as what
    is left when the object had gone as the hand went: 0, 0 where it followed.

    Args:
        deed: the form of the actions.
    """

    def __init__(self, deed: Deed) -> None:
        self.deed = deed
        places = {*deed.start, *deed.end, deed.turn}
        self._fine = FINE * float((deed.high - deed.low)[list(deed.start)].mean())
        self._others = [i for i in range(len(deed.low)) if i not in places]

    def features(self, rows: Array, numbers: Array) -> Array:
        """What is told of n actions to an object, (n, F).

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
        """Actions' numbers, (n, P), start and height told from the object, in the hand's frame."""
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
        """What came of n actions, (n, 3): in the frame, how far x, y are from having followed; z.

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
        """How much the object went as the hand went, (n,).

        It is 1 where it went by the same way, and 0 where it went not more so than by staying.
        """
        left = after[:, :2] - before[:, :2] - self.way(numbers)
        return following(np.linalg.norm(left, axis=1), np.linalg.norm(self.way(numbers), axis=1))


FINE = 0.03
"""Offsets are told twice: once so that those below this share of the range are told apart."""

SHARP = 3
"""Power of the share that is followed: to follow all the way is worth much more than in part."""


def following(left: Array, way: Array) -> Array:
    """1 where nothing is left of the hand's way, 0 where all of it is, or more."""
    return np.clip(1 - left / np.maximum(way, np.finfo(float).tiny), 0.0, 1.0) ** SHARP


def turned(vectors: Array, angle: Array) -> Array:
    """Vectors (..., 2) turned by angles that fit (...)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def orientation(quaternions: Array, angle: Array) -> Array:
    """How bodies lie in frames, (n, 11), the same if a body is turned by half a turn.

    Of each of its three axes the double angle in the plane and the height; of all three the
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
