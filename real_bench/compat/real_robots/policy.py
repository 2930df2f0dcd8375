"""The class that official controllers derive from."""

from real_bench.controller import BasePolicy

__all__ = ["BasePolicy"]
