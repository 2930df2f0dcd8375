"""The map from positions in the image to positions in the hand's reach.

It is learned from contingencies between what the robot did and saw: things move where its hand has
passed, and what it took along lies where the hand ended. Nothing is known about the camera. The map
is the one that makes what was seen most likely: a thing moves if the hand's path comes near it
(reach, blur, and how much less a higher hand touches are learned as well); and of the things that
moved, a learned share ends near the path's end, or at a learned distance ahead.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.optimize  # now, so that the limit of threads finds its BLAS
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from real_bench.errors import RealBenchError
from real_bench.real_g.arrays import Array

N_ROTATIONS = 8
"""How many rotations of the image, each also mirrored, a search begins with."""

N_GUESSES = 300
"""How many maps from three things that moved a search begins with."""

MAX_SAMPLES = 3000
"""The most samples in a fit, drawn evenly."""

MIN_MOVED = 13
"""As many as the fit has parameters."""

MAX_SEARCH_SAMPLES = 400
"""The most samples for choosing where to begin, half of them of things that moved."""

PENALTY = 1.5
"""How much better than chance a map must explain what was seen, in units of the cost of its
parameters by the Bayesian information criterion. That assumes independent samples, which they are
not."""

N_POINTS = 24
"""Number of points along a path."""

IN_REACH = (-3.0, 3.0)
"""Things that were touched, and things seen beside them, are at most this far out of reach."""

BOUNDS = [IN_REACH] * 6 + [(0, 30), (0, 5), (0, 50), (-6, -1), (-5, 5), (-4.6, -1), (-0.5, 0.5)]
"""Of the parameters of a fit, in the order that :class:`_Problem` tells."""

EPSILON = 1e-9


@dataclass(frozen=True, eq=False)
class Contingencies:
    """What the hand did and how a thing was seen to react, n times.

    Attributes:
        before, after: where it was seen, (n, 2), in any units of the image.
        paths: points along the hand's path, (n, k, 2) or with height (n, k, 3), metres.
        moved: whether it moved, (n,) bool.
    """

    before: Array
    after: Array
    paths: Array
    moved: NDArray[np.bool_]

    def __post_init__(self) -> None:
        n = len(self.before)
        if (
            self.before.shape != (n, 2)
            or self.after.shape != (n, 2)
            or self.moved.shape != (n,)
            or self.paths.ndim != 3
            or len(self.paths) != n
            or self.paths.shape[2] not in (2, 3)
        ):
            raise RealBenchError(
                "contingencies need before and after (n, 2), paths (n, k, 2 or 3), moved (n,), "
                f"not {self.before.shape}, {self.after.shape}, {self.paths.shape}, "
                f"{self.moved.shape}"
            )

    def __len__(self) -> int:
        return len(self.moved)

    def subset(self, rows: NDArray[Any]) -> Contingencies:
        """Some of them."""
        return Contingencies(
            self.before[rows], self.after[rows], self.paths[rows], self.moved[rows]
        )


class HandEye:
    """An affine map from positions in the image to x, y in the hand's coordinates.

    Args:
        low, high: the range of x, y that can be commanded, (2,) metres each.
        given: a map that need not be learned, (3, 2); None: none.
    """

    def __init__(self, low: Array, high: Array, given: Array | None = None) -> None:
        self._centre, self._half = (low + high) / 2, float(np.max(high - low)) / 2
        self._map = self._given = given
        self._evidence = 0.0
        self._n_searched = 0

    @property
    def is_known(self) -> bool:
        """Whether there is a map that is better than chance."""
        return self._map is not None

    @property
    def evidence(self) -> float:
        """By how many nats the map explains what moved better than no map."""
        return self._evidence

    @property
    def scale(self) -> float:
        """Metres per unit of the image; NaN while no map is known."""
        return np.nan if self._map is None else float(abs(np.linalg.det(self._map[1:])) ** 0.5)

    def xy(self, positions: Array) -> Array:
        """Metres, (..., 2), of positions in the image, (..., 2); NaN while no map is known."""
        if self._map is None:
            return np.full(np.shape(positions), np.nan)
        return np.asarray(positions @ self._map[1:] + self._map[0])

    def fit(self, contingencies: Contingencies, random: np.random.Generator) -> bool:
        """Learn again from everything seen; returns whether a map is known now.

        It computes with one thread: for matrices as small as these, more only cost time.

        Args:
            contingencies: things and what the hand did, in any order.
            random: for choosing among them if there are too many.
        """
        if self._given is not None:
            return True
        n = len(contingencies)
        if n > MAX_SAMPLES:
            contingencies = contingencies.subset(random.choice(n, MAX_SAMPLES, replace=False))
        if contingencies.moved.all() or contingencies.moved.sum() < MIN_MOVED:
            return self.is_known
        problem = _Problem(contingencies, self._centre, self._half)
        starts = []
        with threadpool_limits(limits=1, user_api="blas"):
            if self._map is None or n >= 2 * self._n_searched:
                self._n_searched = n
                starts = problem.search(random)
            if self._map is not None:
                starts.append(problem.start_from(self._map))
            cost, best = min((problem.optimise(start, 300) for start in starts), key=lambda s: s[0])
        self._evidence = problem.chance_cost - cost
        self._map = problem.to_metres(best) if self._evidence > problem.penalty else None
        return self.is_known

    def get_state(self) -> dict[str, Any]:
        """The map, as plain values."""
        affine = np.zeros((0, 2)) if self._map is None else self._map
        return {"map": affine, "evidence": self._evidence}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with a map."""
        affine = np.asarray(state["map"], np.float64)
        self._map = affine if len(affine) else None
        self._evidence = float(state["evidence"])


class _Problem:
    """Minus the log likelihood of what was seen, in coordinates of about unit size.

    The parameters, 13: map (3, 2); of touch: reach, log of 1 / blur, height's weight, lapses; of
    ends: share, log of spread, distance ahead.
    """

    def __init__(self, contingencies: Contingencies, centre: Array, half: float) -> None:
        self._mean = contingencies.before.mean(axis=0)
        self._spread = max(float(contingencies.before.std(axis=0).max()), EPSILON)
        self._centre, self._half = centre, half
        positions = (contingencies.before - self._mean) / self._spread
        self._moved = contingencies.moved
        self._before = np.column_stack([np.ones(len(positions)), positions])
        points = (contingencies.paths[:, :, :2] - centre) / half
        self._x, self._y = points[:, :, 0].copy(), points[:, :, 1].copy()
        self._height = np.zeros(points.shape[:2])
        if contingencies.paths.shape[2] == 3:
            heights = contingencies.paths[:, :, 2]
            self._height = (heights - heights.min()) / max(float(np.ptp(heights)), EPSILON)
        after = (contingencies.after[contingencies.moved] - self._mean) / self._spread
        self._after = np.column_stack([np.ones(len(after)), after])
        self._background_density = (
            _cauchy(after - positions[contingencies.moved]) + _normal(after)
        ) / 2
        self._end = points[contingencies.moved, -1]
        displacement = self._end - points[contingencies.moved, 0]
        self._direction = displacement / np.maximum(
            np.linalg.norm(displacement, axis=1, keepdims=True), EPSILON
        )
        n, k = len(contingencies), int(contingencies.moved.sum())
        self.chance_cost = (
            -_xlogx(k, n) - _xlogx(n - k, n) - float(np.log(self._background_density).sum())
        )
        self.penalty = PENALTY * 13 / 2 * np.log(max(n, 2))

    def search(self, random: np.random.Generator) -> list[Array]:
        """Where to begin: the best candidate maps, judged by few samples.

        Candidates are rotations of the image, also mirrored, and maps that put three things that
        moved on the hand's paths, or where it ended.
        """
        subset = self._subsample(random)
        maps = [*_rotations(), *(subset.guess_map(random) for _ in range(N_GUESSES))]
        plausible = [affine for affine in maps if np.abs(affine).max() < IN_REACH[1]]
        starts = sorted(
            (self._start(affine) for affine in plausible), key=lambda x: subset.cost(x)[0]
        )
        rough = [subset.optimise(start, 40) for start in starts[:8]]
        return [x for _, x in sorted(rough, key=lambda found: found[0])[:3]]

    def guess_map(self, random: np.random.Generator) -> Array:
        """The map that puts three things that moved where the hand was, (3, 2)."""
        moved = np.flatnonzero(self._moved)
        three = random.choice(len(moved), 3, replace=False)
        if random.random() < 0.5:
            positions, points = self._after[three], self._end[three]
        else:
            positions, rows = self._before[moved[three]], moved[three]
            at = random.integers(self._x.shape[1], size=3)
            points = np.column_stack([self._x[rows, at], self._y[rows, at]])
        return np.asarray(np.linalg.pinv(positions) @ points)

    def start_from(self, affine: Array) -> Array:
        """From a map in metres."""
        offset = (affine[0] + self._mean @ affine[1:] - self._centre) / self._half
        return self._start(np.vstack([offset, affine[1:] * self._spread / self._half]))

    def to_metres(self, parameters: Array) -> Array:
        """The map of parameters, from the image's units to metres, (3, 2)."""
        scaled = parameters[:6].reshape(3, 2)
        linear = scaled[1:] * self._half / self._spread
        return np.vstack([scaled[0] * self._half + self._centre - self._mean @ linear, linear])

    def optimise(self, start: Array, iterations: int) -> tuple[float, Array]:
        """The least cost reached from a start, and its parameters."""
        found = scipy.optimize.minimize(
            self.cost,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=BOUNDS,
            options={"maxiter": iterations},
        )
        return float(found.fun), np.asarray(found.x, np.float64)

    def cost(self, parameters: Array) -> tuple[float, Array]:
        """Minus the log likelihood, and its gradient."""
        touch, touch_gradient = self._touch_cost(parameters)
        ends, end_gradient = self._end_cost(parameters)
        return touch + ends, touch_gradient + end_gradient

    def _subsample(self, random: np.random.Generator) -> _Problem:
        """The problem with few samples, half of which moved."""
        subset = copy.copy(self)
        both = np.flatnonzero(self._moved), np.flatnonzero(~self._moved)
        part = [random.permutation(rows)[: MAX_SEARCH_SAMPLES // 2] for rows in both]
        rows = np.sort(np.concatenate(part))
        subset._before, subset._moved = self._before[rows], self._moved[rows]
        subset._x, subset._y, subset._height = self._x[rows], self._y[rows], self._height[rows]
        kept = np.isin(both[0], rows)
        subset._after, subset._end = self._after[kept], self._end[kept]
        subset._direction, subset._background_density = (
            self._direction[kept],
            self._background_density[kept],
        )
        return subset

    def _start(self, scaled: Array) -> Array:
        return np.concatenate([np.ravel(scaled), [3.0, 3.0, 3.0, -3.0, 0.0, -2.0, 0.0]])

    def _touch_cost(self, parameters: Array) -> tuple[float, Array]:
        scaled = parameters[:6].reshape(3, 2)
        reach, sharpness, weight, lapses = parameters[6], np.exp(parameters[7]), *parameters[8:10]
        x, y = _matmul(self._before, scaled).T
        dx, dy = x[:, None] - self._x, y[:, None] - self._y
        distance = np.sqrt(dx * dx + dy * dy + 1e-6)
        logits = reach - sharpness * distance - weight * self._height
        row, nearest = np.arange(len(logits)), logits.argmax(axis=1)
        logit, distance = logits[row, nearest], distance[row, nearest]
        offset = np.column_stack([dx[row, nearest], dy[row, nearest]])
        height = self._height[row, nearest]
        lapse = 1 / (1 + np.exp(-lapses))
        touched = 1 / (1 + np.exp(-np.clip(logit, -50, 50)))
        p = lapse + (1 - 2 * lapse) * touched
        likelihood = np.where(self._moved, p, 1 - p) + EPSILON
        p_gradient = np.where(self._moved, -1.0, 1.0) / likelihood
        logit_gradient = p_gradient * (1 - 2 * lapse) * touched * (1 - touched)
        position_gradient = (-sharpness * logit_gradient / distance)[:, None] * offset
        gradient = np.zeros(13)
        gradient[:6] = np.ravel(_matmul(self._before.T, position_gradient))
        gradient[6] = logit_gradient.sum()
        gradient[7] = -(logit_gradient * sharpness * distance).sum()
        gradient[8] = -(logit_gradient * height).sum()
        gradient[9] = (p_gradient * (1 - 2 * touched)).sum() * lapse * (1 - lapse)
        return -float(np.log(likelihood).sum()), gradient

    def _end_cost(self, parameters: Array) -> tuple[float, Array]:
        """A share ends near the end of the path, the rest near where it began or anywhere."""
        scaled, (logit, spread, ahead) = parameters[:6].reshape(3, 2), parameters[10:]
        share, variance = 1 / (1 + np.exp(-logit)), np.exp(2 * spread)
        offset = _matmul(self._after, scaled) - self._end - ahead * self._direction
        squared = (offset**2).sum(axis=1)
        area = abs(scaled[1, 0] * scaled[2, 1] - scaled[1, 1] * scaled[2, 0]) + EPSILON
        near = area * np.exp(-np.minimum(squared / (2 * variance), 700)) / (2 * np.pi * variance)
        likelihood = share * near + (1 - share) * self._background_density + EPSILON
        responsible = share * near / likelihood
        offset_gradient = (responsible / variance)[:, None] * offset
        gradient = np.zeros(13)
        gradient[:6] = np.ravel(_matmul(self._after.T, offset_gradient))
        inverse = np.linalg.pinv(scaled[1:])
        gradient[2:6] -= responsible.sum() * np.ravel(inverse.T)
        gradient[10] = -((near - self._background_density) / likelihood).sum() * share * (1 - share)
        gradient[11] = -(responsible * (squared / variance - 2)).sum()
        gradient[12] = -(offset_gradient * self._direction).sum()
        return -float(np.log(likelihood).sum()), gradient


def _cauchy(displacements: Array) -> Array:
    """How likely each of (n, 2) ways is, if half of all are shorter than their median, (n,)."""
    lengths = np.linalg.norm(displacements, axis=1)
    scale = max(float(np.median(lengths)) / np.sqrt(3), EPSILON) if len(lengths) else 1.0
    return np.asarray(scale / (2 * np.pi * (scale**2 + lengths**2) ** 1.5))


def _normal(positions: Array) -> Array:
    """How likely each of (n, 2) positions is, if they are normally distributed, (n,)."""
    if len(positions) < 3:
        return np.zeros(len(positions))
    centred = positions - positions.mean(axis=0)
    covariance = np.cov(centred.T) + EPSILON * np.eye(2)
    squared = (centred @ np.linalg.inv(covariance) * centred).sum(axis=1)
    return np.asarray(np.exp(-squared / 2) / (2 * np.pi * np.sqrt(np.linalg.det(covariance))))


def _rotations() -> list[Array]:
    """Maps of every turn, and mirrored, (3, 2) each."""
    maps = []
    for angle in np.arange(N_ROTATIONS) * 2 * np.pi / N_ROTATIONS:
        c, s = np.cos(angle), np.sin(angle)
        maps += [0.4 * np.array([[0, 0], [c, s], [-s * m, c * m]]) for m in (1.0, -1.0)]
    return maps


def _matmul(one: Array, other: Array) -> Array:
    """Their product; for a few columns, threads only cost time."""
    return np.asarray(np.einsum("ij,jk->ik", one, other))


def resample_path(corners: Array, n: int = N_POINTS) -> Array:
    """Points on the straight way from corner to corner, (k, 2 or 3) to (n, 2 or 3)."""
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    wanted = np.linspace(0, at[-1], n)
    return np.column_stack([np.interp(wanted, at, column) for column in corners.T])


def _xlogx(k: int, n: int) -> float:
    return k * float(np.log(k / n)) if k else 0.0
