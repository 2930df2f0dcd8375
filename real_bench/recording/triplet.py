"""One triplet (s, a, s') of a recording, whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action


@dataclass(frozen=True)
class State:
    """What was the case between two actions.

    Attributes:
        step: how many simulation steps were over.
        joint_positions: of the robot, (9,) radians.
        touch_sensors: (4,) newtons.
        object_poses: the truth, position (m) and quaternion (x, y, z, w) of each object,
            (n_objects, 7); None in an excerpt for a controller that may not see them.
        image: the camera's, (height, width, 3) uint8; None where images were not recorded.
    """

    step: int
    joint_positions: NDArray[np.float64]
    touch_sensors: NDArray[np.float64]
    object_poses: NDArray[np.float64] | None
    image: NDArray[np.uint8] | None


@dataclass(frozen=True)
class Triplet:
    """What an action was done in, the action as it was executed, and what came of it."""

    before: State
    action: Action
    after: State
