"""The parts of REAL-G: self-generated goals, and a hand that learns to grasp, carry and place.

All but perception and architecture work on plain arrays.
"""

from real_bench.real_g.architecture import RealG
from real_bench.real_g.hand import Hand, Primitive, Push, primitive_of
from real_bench.real_g.in_joints import RealGInJoints
from real_bench.real_g.model_planner import PlannerSettings
from real_bench.real_g.perception import Perception, PosePerception
from real_bench.real_g.play import PlaySettings
from real_bench.real_g.seen_images import ImagePerception
from real_bench.real_g.watching import WatchingSettings

__all__ = [
    "Hand",
    "ImagePerception",
    "Perception",
    "PlannerSettings",
    "PlaySettings",
    "PosePerception",
    "Primitive",
    "Push",
    "RealG",
    "RealGInJoints",
    "WatchingSettings",
    "primitive_of",
]
