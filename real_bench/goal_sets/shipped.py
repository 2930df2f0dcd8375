"""The goal sets that ship with realbench."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from real_bench.errors import GoalSetError
from real_bench.goal_sets.file import load_goal_set
from real_bench.text.counting import counted
from real_bench.text.quoting import quoted

OFFICIAL = "official"


def shipped_goal_set(n_objects: int, scene: str = OFFICIAL) -> Path:
    """The file of the 50 goals that ship for a scene and 1, 2 or 3 objects.

    Raises:
        GoalSetError: none ships for these.
    """
    of_scene = "" if scene == OFFICIAL else f"{scene}-"
    plural = "" if n_objects == 1 else "s"
    name = f"goals-{of_scene}{n_objects}-object{plural}.npy"
    ships = {path.name: path for path in Path(str(files("real_bench.goals"))).glob("*.npy")}
    if name not in ships:
        raise GoalSetError(
            f"no goal set ships for {counted(n_objects, 'object')} in scene {quoted(scene)}: "
            "draw one with `realbench goals generate`"
        )
    return ships[name]


def shipped_sizes(n_objects: int, scene: str) -> dict[str, int]:
    """How many goals the shipped set has, by its hash; empty if none ships."""
    try:
        goal_set = load_goal_set(shipped_goal_set(n_objects, scene))
    except GoalSetError:
        return {}
    return {goal_set.sha256: len(goal_set)}
