"""Which posture puts the hand where: an inverse map by goal babbling.

The robot tries to reach points a little beyond those that it has reached, with the postures that
local regression over what it has seen proposes, and some noise (Rolf, Steil and Gienger 2010).
Since new postures are near old ones, the map keeps to one of the many ways to reach a point.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from real_bench.real_g.arrays import Array

N_FIRST, FIRST_NOISE, NOISE = 25, 0.1, 0.05
"""Postures around the first one, and the deviation of postures' noise then and later, radians."""

LOWEST, LOW, HIGHEST = 0.02, 0.05, 0.25
"""Targets are this far above the ground, in shares of its distance; half are between the first."""

STEP = 0.13
"""The farthest that a target is from what was reached."""

FILLING = 0.065
"""How far targets near what was reached are from it."""

MAX_ERROR = 0.3
"""A posture that ends farther from its target has left the map's branch."""

NEIGHBOURS, ENOUGH, MIN_WIDTH, RIDGE = 40, 12, 0.075, 0.0006
"""Local regression: the postures it uses, the nearest of which have full weight, and no fewer than
those within the width."""

PUSH_HEIGHT, RAISED_HEIGHT = 0.03, 0.2
"""Of pushes, and of the hand before and after, in shares of the ground's distance."""

MARGIN = 0.01
"""The planes reach from this quantile of the low points to its opposite."""

CORRECTED, RAISED = 0.7, 0.01
"""A node's next aim is corrected by this share of its error, or raised where the arm is blocked."""

SQUARE = 0.1
"""Side of a square of the ground, in its distance."""

NEWTON_STEPS, CONVERGED = 8, 1e-9
"""Newton's method takes as many steps from each node, until a posture is met, radians."""


class Reach:
    """Postures, and where the hand was seen in them.

    Args:
        low, high: of the postures, (J,) radians.
    """

    def __init__(self, low: Array, high: Array) -> None:
        self._low, self._high = low, high
        self.points, self.postures = np.zeros((0, 3)), np.zeros((0, len(low)))

    def __len__(self) -> int:
        return len(self.points)

    def add(self, point: Array, posture: Array) -> None:
        """The hand was seen at a point, (3,), in a posture, (J,)."""
        self.points = np.vstack([self.points, point])
        self.postures = np.vstack([self.postures, posture])

    def next_target(self, ground: Array, random: np.random.Generator) -> Array | None:
        """A point to try, (3,), above one of the (n, 3) points of the ground; None at first."""
        if len(self) < N_FIRST:
            return None
        if random.random() < 0.4:
            near = self.points[random.integers(len(self))]
            return np.asarray(near + random.normal(size=3) * FILLING)
        point = ground[random.integers(len(ground))]
        height = random.uniform(LOWEST, LOW if random.random() < 0.5 else HIGHEST)
        goal = point * (1 - height / point[2])  # before the same pixel
        offsets = goal - self.points
        distances = np.linalg.norm(offsets, axis=1)
        nearest = int(distances.argmin())
        part = min(1.0, STEP / max(float(distances[nearest]), STEP))
        return np.asarray(self.points[nearest] + offsets[nearest] * part)

    def explore(self, target: Array | None, random: np.random.Generator) -> Array:
        """A posture to try for a target, (J,)."""
        if target is None:
            posture, noise = self.postures[0], FIRST_NOISE
        else:
            posture, noise = self.posture(target), NOISE
        posture = posture + random.normal(size=len(posture)) * noise
        return np.asarray(np.clip(posture, self._low, self._high))

    def posture(self, target: Array) -> Array:
        """The posture that is expected to put the hand at a point, (3,) to (J,)."""
        distances = np.linalg.norm(self.points - target, axis=1)
        chosen = np.argsort(distances, kind="stable")[:NEIGHBOURS]
        distances = distances[chosen]
        width = max(MIN_WIDTH, float(distances[min(ENOUGH, len(chosen) - 1)]))
        weights = np.exp(-(distances**2) / (2 * width**2))[:, None]
        inputs = np.column_stack([np.ones(len(chosen)), self.points[chosen] - target])
        ridge = RIDGE * np.diag([1e-6, 1.0, 1.0, 1.0])
        weighted = inputs * weights
        solution = np.linalg.solve(inputs.T @ weighted + ridge, weighted.T @ self.postures[chosen])
        return np.asarray(np.clip(solution[0], self._low, self._high))

    def is_near(self, point: Array, target: Array | None) -> bool:
        """Whether a point belongs to the map, seen when a target was tried."""
        aim = self.points[0] if target is None else target
        return bool(np.linalg.norm(point - aim) < MAX_ERROR)

    @property
    def coverage(self) -> int:
        """How many squares of the ground it reaches, near the ground."""
        return len(np.unique(np.floor(self._low_points()[:, :2] / SQUARE), axis=0))

    def _low_points(self) -> Array:
        return self.points[(self.points[:, 2] > 1 - 2 * LOW) & (self.points[:, 2] < 1)]

    def extent(self) -> Array:
        """The first and the last x, y near the ground, (2, 2)."""
        low = self._low_points()
        if len(low) < N_FIRST:
            low = self.points
        return np.quantile(low[:, :2], [MARGIN, 1 - MARGIN], axis=0)

    def get_state(self) -> dict[str, Any]:
        """All of it."""
        return {"points": self.points, "postures": self.postures}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on from there."""
        self.points = np.asarray(state["points"], np.float64).reshape(-1, 3)
        self.postures = np.asarray(state["postures"], np.float64).reshape(-1, len(self._low))


class Refinement:
    """Postures for a grid over the ground, near it and raised, each tried until it is precise.

    A posture that the map proposes ends beside its aim, or the arm meets the ground before. So the
    next aim is corrected, and of all that was tried the posture that was seen nearest is kept.

    Args:
        reach: the map; what is seen is added to it.
        n_grid: nodes along each side of the grid, at least 4.
    """

    def __init__(self, reach: Reach, n_grid: int) -> None:
        self._reach = reach
        first, last = reach.extent()
        self._x, self._y = (np.linspace(a, b, n_grid) for a, b in zip(first, last, strict=True))
        self._nodes = np.array(
            [
                [u, v, 1 - height]
                for height in (RAISED_HEIGHT, PUSH_HEIGHT)
                for row, u in enumerate(self._x)
                for v in (self._y if row % 2 == 0 else self._y[::-1])  # to and fro
            ]
        )
        self._aims = self._nodes.copy()
        self._errors = np.full(len(self._nodes), np.inf)
        self._postures = np.array([reach.posture(node) for node in self._nodes])

    def __len__(self) -> int:
        return len(self._nodes)

    def posture(self, number: int) -> Array:
        """The posture to try for a node, (J,)."""
        return self._reach.posture(self._aims[number])

    def observe(self, number: int, point: Array | None, posture: Array) -> None:
        """The hand was seen at a point, (3,), in a node's posture; None if it was blocked."""
        if point is None:
            self._aims[number, 2] -= RAISED
        else:
            offset = point - self._nodes[number]
            error = float(np.linalg.norm(offset))
            if error < MAX_ERROR:
                self._reach.add(point, posture)
                self._aims[number] -= CORRECTED * offset
            if error < self._errors[number]:
                self._errors[number], self._postures[number] = error, posture
        if not np.isfinite(self._errors[number]):
            self._postures[number] = self.posture(number)

    def planes(self) -> Planes:
        """The best postures, as smooth functions of x, y."""
        raised, near = self._postures.reshape(2, len(self._x), len(self._y), -1).copy()
        for grid in (raised, near):
            grid[1::2] = grid[1::2, ::-1]
        return Planes(self._x, self._y, np.array([near, raised]))

    def get_state(self) -> dict[str, Any]:
        """All of it but the map."""
        names = ("x", "y", "nodes", "aims", "errors", "postures")
        return {name: getattr(self, f"_{name}").copy() for name in names}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on from there."""
        for name, value in state.items():
            setattr(self, f"_{name}", np.array(value, np.float64))


class Planes:
    """Postures over the ground, near it and raised: smooth functions of x, y.

    Args:
        x, y: of a grid, (n,) and (m,), in the hand's coordinates.
        postures: on its nodes, (2, n, m, J): near the ground, and raised.
    """

    def __init__(self, x: Array, y: Array, postures: Array) -> None:
        self.low, self.high = np.array([x[0], y[0]]), np.array([x[-1], y[-1]])
        self._x, self._y, self._postures = x, y, postures
        self._splines = [
            [scipy.interpolate.RectBivariateSpline(x, y, each) for each in np.moveaxis(grid, 2, 0)]
            for grid in postures
        ]

    def near(self, xy: Array) -> Array:
        """Postures near the ground, (k, 2) to (k, J)."""
        return self._evaluate(0, xy)

    def raised(self, xy: Array) -> Array:
        """Postures above, (k, 2) to (k, J)."""
        return self._evaluate(1, xy)

    def position(self, posture: Array) -> Array:
        """Where a posture near the ground puts the hand, (J,) to x, y: the inverse of near()."""
        distances = np.linalg.norm(self._postures[0] - posture, axis=2)
        best, least = self.low, np.inf
        for node in np.argsort(distances, axis=None, kind="stable"):
            row, column = np.unravel_index(int(node), distances.shape)
            xy = self._newton(posture, np.array([self._x[row], self._y[column]]))
            error = float(np.abs(self.near(xy[None])[0] - posture).max())
            if error < least:
                best, least = xy, error
            if least < CONVERGED:
                break
        return best

    def _newton(self, posture: Array, xy: Array) -> Array:
        for _ in range(NEWTON_STEPS):
            error = posture - self.near(xy[None])[0]
            slopes = [self._evaluate(0, xy[None], dx=1)[0], self._evaluate(0, xy[None], dy=1)[0]]
            step = np.linalg.lstsq(np.array(slopes).T, error, rcond=None)[0]
            xy = np.clip(xy + step, self.low, self.high)
        return xy

    def _evaluate(self, plane: int, xy: Array, dx: int = 0, dy: int = 0) -> Array:
        columns = [spline.ev(xy[:, 0], xy[:, 1], dx=dx, dy=dy) for spline in self._splines[plane]]
        return np.column_stack(columns)
