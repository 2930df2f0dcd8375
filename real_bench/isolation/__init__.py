"""Controllers in a process of their own, within walls; see docs/security.md."""

from real_bench.isolation.host import IsolatedHost
from real_bench.isolation.limits import Limits
from real_bench.isolation.walls import Walls, bare_walls, found_walls

__all__ = ["IsolatedHost", "Limits", "Walls", "bare_walls", "found_walls"]
