"""The simulated world: scenes, bodies, camera, and the fast loop."""

from typing import TYPE_CHECKING

from real_bench.lazy import lazy_names

if TYPE_CHECKING:
    from real_bench.simulation.camera import Image
    from real_bench.simulation.posture import HOME
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

if not TYPE_CHECKING:  # or checkers would take any name for one of these
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "camera": ("Image",),
            "posture": ("HOME",),
            "scene": ("DEFAULT_SCENE", "Scene", "load_scene"),
            "simulation": ("STEP_S", "Segment", "Simulation"),
        },
    )
