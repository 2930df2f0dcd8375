"""One complete triplet (s, a, s') of a recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action


@dataclass(frozen=True, eq=False)
class State:
    """The state between two actions.

    Attributes:
        step: how many simulation steps were over.
        joint_positions: of the robot, (9,) radians.
        touch_sensors: (4,) newtons.
        object_poses: true position (m) and quaternion (x, y, z, w) of each object,
            (n_objects, 7); None in an excerpt for a controller that may not see them.
        image: the camera's, (height, width, 3) uint8; None if images were not recorded.
    """

    step: int
    joint_positions: NDArray[np.float64]
    touch_sensors: NDArray[np.float64]
    object_poses: NDArray[np.float64] | None
    image: NDArray[np.uint8] | None


@dataclass(frozen=True)
class Triplet:
    """The state before an action, the action as executed, and the state after it."""

    before: State
    action: Action
    after: State
