"""The forms of action, and numbers for them."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from real_bench.conditions import Condition
from real_bench.real_g.hand import Hand, Primitive, Push, primitive_of
from real_bench.simulation.scene import load_scene
from real_bench.spaces import action_space

Array = NDArray[np.float64]


def _space(condition: str) -> Any:
    return action_space(load_scene("builtin"), Condition.parse(condition))


HAND, PUSH = Hand(_space("OC")), Push(_space("OM"))
DEEDS: tuple[Primitive, ...] = (HAND, PUSH)
JOINTS = _space("OJ")

__all__ = ["DEEDS", "HAND", "JOINTS", "PUSH", "drawn", "numbers_of", "primitive_of", "rows"]


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
