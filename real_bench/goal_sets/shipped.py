"""The goal sets that ship with realbench."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from real_bench.errors import GoalSetError


def shipped_goal_set(n_objects: int) -> Path:
    """The file of the shipped 50 goals for 1, 2 or 3 objects, in scene official.

    Raises:
        GoalSetError: there is none for that number of objects.
    """
    plural = "" if n_objects == 1 else "s"
    path = Path(str(files("real_bench.goals") / f"goals-{n_objects}-object{plural}.npy"))
    if not path.is_file():
        raise GoalSetError(
            f"no goal set ships for {n_objects} objects: generate one, or use 1 to 3"
        )
    return path
