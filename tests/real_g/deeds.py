"""The forms of action, and numbers for them."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from real_bench.conditions import Condition
from real_bench.real_g.hand import Hand, Primitive, Push, primitive_of
from real_bench.real_g.joint_push import JointPush
from real_bench.real_g.reach import Planes
from real_bench.simulation.scene import load_scene
from real_bench.spaces import action_space

Array = NDArray[np.float64]


def _space(condition: str) -> Any:
    return action_space(load_scene("builtin"), Condition.parse(condition))


def _planes() -> Planes:
    """Smooth postures of seven joints over a table."""
    x, y = np.linspace(-0.4, 0.4, 11), np.linspace(-0.3, 0.1, 11)
    u, v = np.meshgrid(x, y, indexing="ij")
    one = np.stack([u, v, u + v, u * v, u**2, np.sin(3 * v), 0 * u], axis=2)
    return Planes(x, y, np.array([one, one + 0.3]))


HAND, PUSH = Hand(_space("OC")), Push(_space("OM"))
JOINT_PUSH = JointPush(_planes())
DEEDS: tuple[Primitive, ...] = (HAND, PUSH, JOINT_PUSH)
JOINTS = _space("OJ")

__all__ = [
    "DEEDS",
    "HAND",
    "JOINTS",
    "JOINT_PUSH",
    "PUSH",
    "drawn",
    "numbers_of",
    "primitive_of",
    "rows",
]


def drawn(deed: Primitive, n: int, seed: int = 0) -> Array:
    """Numbers of n actions."""
    return np.random.default_rng(seed).uniform(deed.low, deed.high, (n, len(deed.low)))


@st.composite
def numbers_of(draw: st.DrawFn, deed: Primitive) -> Array:
    """Numbers of an action, ends of their ranges included."""
    shares = draw(st.lists(st.floats(0, 1), min_size=len(deed.low), max_size=len(deed.low)))
    return deed.low + np.array(shares) * (deed.high - deed.low)


def rows(n: int, seed: int = 0) -> Array:
    """Rows of an object with orientations, (n, 7)."""
    random = np.random.default_rng(seed)
    turns = random.normal(size=(n, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    return np.hstack([random.uniform(-0.3, 0.3, (n, 3)), turns])
