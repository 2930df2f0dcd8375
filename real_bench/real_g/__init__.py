"""The parts of REAL-G: self-generated goals, and a hand that learns to grasp, carry and place.

All but perception and architecture work on plain arrays.
"""

from real_bench.real_g.architecture import PlannerSettings, RealG
from real_bench.real_g.hand import Deed, Hand, Push, deed_of
from real_bench.real_g.perception import Perception, SeenPoses
from real_bench.real_g.play import PlaySettings
from real_bench.real_g.seen_images import SeenImages

__all__ = [
    "Deed",
    "Hand",
    "Perception",
    "PlannerSettings",
    "PlaySettings",
    "Push",
    "RealG",
    "SeenImages",
    "SeenPoses",
    "deed_of",
]
