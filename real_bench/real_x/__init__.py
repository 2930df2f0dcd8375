"""The parts of the REAL-X architecture (paper, section REAL-X blueprint).

Explorer, triplets, abstraction and planner work on plain arrays; perception makes these from
observations, and the architecture combines all parts into a controller.
"""

from real_bench.real_x.abstraction import N_LEVELS, DynamicAbstraction
from real_bench.real_x.architecture import AbstractionSettings, PlannerSettings, RealX
from real_bench.real_x.explorer import RandomExplorer
from real_bench.real_x.perception import BlurredImages, ObjectPositions, Perception
from real_bench.real_x.planner import DEPTH, Plan, Planner
from real_bench.real_x.triplets import Triplets

__all__ = [
    "DEPTH",
    "N_LEVELS",
    "AbstractionSettings",
    "BlurredImages",
    "DynamicAbstraction",
    "ObjectPositions",
    "Perception",
    "Plan",
    "Planner",
    "PlannerSettings",
    "RandomExplorer",
    "RealX",
    "Triplets",
]
