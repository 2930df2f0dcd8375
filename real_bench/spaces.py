"""The spaces that a controller gets: what it may command and what it may observe."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from real_bench.conditions import Condition
from real_bench.simulation.scene import Scene

UNIT = 1.0 + 1e-6  # a component of a unit quaternion, with room for rounding


def action_space(scene: Scene, condition: Condition) -> spaces.Dict:
    """The official action dict of a condition; a command may also be None."""
    boxes = condition.control_type.boxes(scene.manifest.limits)
    return spaces.Dict({**boxes, "render": spaces.MultiBinary(1)})


def observation_space(scene: Scene, condition: Condition, n_objects: int) -> spaces.Dict:
    """The official observation keys of a condition; positions and masks only where it has O."""
    camera, names = scene.manifest.camera, scene.object_names(n_objects)
    size = (camera.height, camera.width)
    senses: dict[str, spaces.Space[Any]] = {
        "joint_positions": spaces.Box(-np.inf, np.inf, (9,), np.float64),
        "touch_sensors": spaces.Box(0, np.inf, (4,), np.float64),
        "retina": spaces.Box(0, 255, (*size, 3), np.uint8),
        "depth": spaces.Box(0, 1, size, np.float32),
        "goal": spaces.Box(0, 255, (*size, 3), np.uint8),
    }
    if condition.sees_objects:
        senses |= {
            "mask": spaces.Box(-1, 255, size, np.int32),
            "goal_mask": spaces.Box(-1, 255, size, np.int32),
            "object_positions": _each(names, -np.inf, np.inf, 3),
            "object_orientations": _each(names, -UNIT, UNIT, 4),
            "goal_positions": _each(names, -np.inf, np.inf, 3),
        }
    return spaces.Dict(senses)


def _each(names: tuple[str, ...], low: float, high: float, size: int) -> spaces.Dict:
    return spaces.Dict({name: spaces.Box(low, high, (size,), np.float64) for name in names})
