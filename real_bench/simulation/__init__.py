"""The simulated world: scenes, bodies, camera, and the fast loop."""

from real_bench.simulation.camera import Image
from real_bench.simulation.robot import HOME
from real_bench.simulation.scene import DEFAULT_SCENE, Scene, load_scene
from real_bench.simulation.simulation import STEP_S, Segment, Simulation

__all__ = [
    "DEFAULT_SCENE",
    "HOME",
    "STEP_S",
    "Image",
    "Scene",
    "Segment",
    "Simulation",
    "load_scene",
]
