"""Goals: the records, their files, the official files, the generator and pictures of them."""

from typing import TYPE_CHECKING

from real_bench.lazy import lazy_names

if TYPE_CHECKING:
    from real_bench.goal_sets.file import as_goal_set, load_goal_set, save_goal_set
    from real_bench.goal_sets.generator import OFFICIAL_COUNTS, generate_goal_set
    from real_bench.goal_sets.goal import CHALLENGES, Goal, GoalSet
    from real_bench.goal_sets.official import import_official
    from real_bench.goal_sets.picture import captioned, contact_sheet, trial_strip
    from real_bench.goal_sets.selection import goals_in_proportion
    from real_bench.goal_sets.shipped import shipped_goal_set, shipped_sizes

__all__ = [
    "CHALLENGES",
    "OFFICIAL_COUNTS",
    "Goal",
    "GoalSet",
    "as_goal_set",
    "captioned",
    "contact_sheet",
    "generate_goal_set",
    "goals_in_proportion",
    "import_official",
    "load_goal_set",
    "save_goal_set",
    "shipped_goal_set",
    "shipped_sizes",
    "trial_strip",
]

if not TYPE_CHECKING:  # or checkers would take any name for one of these
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "file": ("as_goal_set", "load_goal_set", "save_goal_set"),
            "generator": ("OFFICIAL_COUNTS", "generate_goal_set"),
            "goal": ("CHALLENGES", "Goal", "GoalSet"),
            "official": ("import_official",),
            "picture": ("captioned", "contact_sheet", "trial_strip"),
            "selection": ("goals_in_proportion",),
            "shipped": ("shipped_goal_set", "shipped_sizes"),
        },
    )
