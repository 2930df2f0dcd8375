"""The names of the official package real-robots 0.1.21 that users import, by realbench."""

from real_bench.compat.registration import register

from . import policy
from .evaluate import evaluate

__all__ = ["envs", "evaluate", "policy"]

register()


def __getattr__(name: str) -> object:
    """Import environments, and with them the simulation, only when they are needed."""
    if name == "envs":
        from . import envs

        return envs
    raise AttributeError(f"realbench's module real_robots has no {name}")
