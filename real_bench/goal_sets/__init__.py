"""Goals: the records, their files, the official files, the generator and pictures of them."""

from real_bench.goal_sets.file import load_goal_set, save_goal_set
from real_bench.goal_sets.generator import OFFICIAL_COUNTS, generate_goal_set
from real_bench.goal_sets.goal import CHALLENGES, Goal, GoalSet
from real_bench.goal_sets.official import import_official
from real_bench.goal_sets.picture import contact_sheet, trial_strip
from real_bench.goal_sets.shipped import shipped_goal_set

__all__ = [
    "CHALLENGES",
    "OFFICIAL_COUNTS",
    "Goal",
    "GoalSet",
    "contact_sheet",
    "generate_goal_set",
    "import_official",
    "load_goal_set",
    "save_goal_set",
    "shipped_goal_set",
    "trial_strip",
]
