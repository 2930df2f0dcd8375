"""Realbench: the REAL benchmark of robot open-ended autonomous learning.

>>> import real_bench
>>> env = real_bench.make_env(scene="builtin", condition="OM", objects=1)
>>> observation, info = env.reset(seed=0)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from real_bench.registration import register
from real_bench.version import __version__

if TYPE_CHECKING:
    from real_bench.environment import RealEnv

register()

__all__ = ["__version__", "make_env"]


def make_env(**arguments: Any) -> RealEnv:
    """The benchmark as a Gymnasium environment.

    Takes the arguments of :class:`real_bench.environment.RealEnv`: ``condition``, ``objects``,
    ``scene``, ``goals``, ``max_steps``, ``render_mode``.
    """
    from real_bench.environment import RealEnv

    return RealEnv(**arguments)
