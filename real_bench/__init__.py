"""Realbench: the REAL benchmark of robot open-ended autonomous learning.

>>> import real_bench
>>> env = real_bench.make_env(scene="builtin", condition="OM", objects=1)
>>> observation, info = env.reset(seed=0)
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from real_bench.registration import register
from real_bench.version import __version__

if TYPE_CHECKING:
    from real_bench.environment import RealEnv
    from real_bench.goal_sets import GoalSet

register()

__all__ = ["__version__", "make_env"]


def make_env(
    condition: str = "OM",
    *,
    objects: int = 1,
    scene: str | Path = "official",
    goals: GoalSet | str | Path | None = None,
    max_steps: int | None = None,
    render_mode: str | None = None,
) -> RealEnv:
    """The benchmark as a Gymnasium environment; see :class:`real_bench.environment.RealEnv`."""
    from real_bench.environment import RealEnv

    return RealEnv(
        condition,
        objects=objects,
        scene=scene,
        goals=goals,
        max_steps=max_steps,
        render_mode=render_mode,
    )
