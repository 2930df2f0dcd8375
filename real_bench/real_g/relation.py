"""An action relative to an object: where the hand arrives, how it is turned, where it goes.

Everything is in the hand's frame (its yaw, or a push's direction if it has none), so that what is
learned at one position holds at every other.
"""

from __future__ import annotations

import numpy as np

from real_bench.real_g.arrays import Array
from real_bench.real_g.hand import Primitive


class Relation:
    """Turns objects' rows and actions' parameters into what a model learns from.

    A row is x, y, z of an object, and its quaternion if known. An outcome is relative to having
    followed the hand: 0, 0 if the object followed.

    Args:
        primitive: the form of the actions.
    """

    def __init__(self, primitive: Primitive) -> None:
        self.primitive = primitive
        places = {*primitive.start, *primitive.end, primitive.yaw}
        self._fine_scale = FINE_SHARE * float(
            (primitive.high - primitive.low)[list(primitive.start)].mean()
        )
        self._others = [i for i in range(len(primitive.low)) if i not in places]

    def features(self, rows: Array, parameters: Array) -> Array:
        """Features of n actions on an object, (n, F).

        Args:
            rows: the object before each, (n, 3 or 7).
            parameters: the actions', (n, P).
        """
        primitive, angle = self.primitive, self.angle(parameters)
        relative = self.relative(rows, parameters)
        offset, others = relative[:, primitive.start], relative[:, self._others]
        displacement = self.displacement(parameters)
        parts = [
            offset,
            np.arcsinh(offset / self._fine_scale),
            rows[:, :3],
            rotate(displacement, -angle),
            displacement,
            parameters[:, primitive.end],
            np.column_stack([np.sin(angle), np.cos(angle), np.linalg.norm(displacement, axis=1)]),
            others,
        ]
        if rows.shape[1] == 7:
            parts.append(orientation_features(rows[:, 3:], angle))
        return np.concatenate(parts, axis=1)

    def relative(self, rows: Array, parameters: Array) -> Array:
        """Actions' parameters, (n, P), start and height relative to the object, in hand's frame."""
        primitive, relative = self.primitive, parameters.copy()
        relative[:, primitive.start] = rotate(
            parameters[:, primitive.start] - rows[:, :2], -self.angle(parameters)
        )
        if primitive.height is not None:
            relative[:, primitive.height] -= rows[:, 2]
        return relative

    def angle(self, parameters: Array) -> Array:
        """The frame's yaw about the vertical, (n,) radians."""
        if self.primitive.yaw is not None:
            return parameters[:, self.primitive.yaw]
        displacement = self.displacement(parameters)
        return np.asarray(np.arctan2(displacement[:, 1], displacement[:, 0]))

    def goals(self, ends: Array, random: np.random.Generator, told: float) -> Array:
        """Goals at (n, 2) ends, (n, G).

        A share of them tells how high the way there goes, drawn from its range. The others leave it
        open: NaN.
        """
        primitive = self.primitive
        rest = list(primitive.goal[2:])
        size = len(ends), len(rest)
        drawn = random.uniform(primitive.low[rest], primitive.high[rest], size)
        return np.column_stack([ends, np.where(random.random(size) < told, drawn, np.nan)])

    def displacement(self, parameters: Array) -> Array:
        """How far the hand goes, (n, 2)."""
        return np.asarray(parameters[:, self.primitive.end] - parameters[:, self.primitive.start])

    def outcome(self, before: Array, after: Array, parameters: Array) -> Array:
        """Outcomes of n actions, (n, 3): x, y in the frame relative to having followed; z.

        Args:
            before: rows of the object, (n, 3 or 7).
            after: its rows after each.
            parameters: the actions', (n, P).
        """
        remaining = after[:, :2] - before[:, :2] - self.displacement(parameters)
        return np.column_stack(
            [rotate(remaining, -self.angle(parameters)), after[:, 2] - before[:, 2]]
        )

    def end_positions(self, before: Array, outcomes: Array, parameters: Array) -> Array:
        """Where objects end, (n, ..., 3), by (n, ..., 3) outcomes of n actions."""
        extra = outcomes.ndim - 2
        angle = self.angle(parameters).reshape(-1, *[1] * extra)
        start = np.concatenate(
            [before[:, :2] + self.displacement(parameters), before[:, 2:3]], axis=1
        )
        start = start.reshape(len(before), *[1] * extra, 3)
        flat = rotate(outcomes[..., :2], angle)
        return np.asarray(start + np.concatenate([flat, outcomes[..., 2:]], axis=-1))

    def static_outcome(self, parameters: Array) -> Array:
        """The outcome of actions that move nothing, (n, 3)."""
        displacement = rotate(-self.displacement(parameters), -self.angle(parameters))
        return np.column_stack([displacement, np.zeros(len(displacement))])

    def contingency(self, before: Array, after: Array, parameters: Array) -> Array:
        """How much the object followed the hand, (n,).

        1 if it moved by the same vector, 0 if it is no nearer to that than by staying.
        """
        remaining = after[:, :2] - before[:, :2] - self.displacement(parameters)
        return following_score(
            np.linalg.norm(remaining, axis=1), np.linalg.norm(self.displacement(parameters), axis=1)
        )


FINE_SHARE = 0.03
"""Offsets are given twice: once scaled to resolve those below this share of the range."""

FOLLOWING_EXPONENT = 3
"""Power of the share followed: following all the way is worth much more than in part."""


def following_score(remaining: Array, displacement: Array) -> Array:
    """1 if nothing is left of the hand's way, 0 if all of it is left, or more."""
    return (
        np.clip(1 - remaining / np.maximum(displacement, np.finfo(float).tiny), 0.0, 1.0)
        ** FOLLOWING_EXPONENT
    )


def random_distance(n: int) -> float:
    """How far apart two random points are, of n uniform parameters of range 1: root mean square."""
    return float(np.sqrt(n / 6))


def rotate(vectors: Array, angle: Array) -> Array:
    """Vectors (..., 2) turned by angles that fit (...)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def orientation_features(quaternions: Array, angle: Array) -> Array:
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
