"""Whether an arm is out of the camera's way (paper, section REAL-LD: joint actions)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from real_bench.actions import ACTION_STEPS
from real_bench.recording import Experience

HOME_TOLERANCE_RAD = 0.1
"""The largest joint angle (at home all are 0) at which the arm is still out of view.
With joint actions the 150 steps at the end are not always enough to come home. Measured on images
after which no object had moved: beyond 0.1 they differ in hundreds of pixels, below in single ones.
"""


def is_home(joint_positions: ArrayLike) -> NDArray[np.bool_]:
    """Whether the robot is home, (..., 9) radians to (...)."""
    return np.asarray((np.abs(joint_positions) < HOME_TOLERANCE_RAD).all(axis=-1))


def plannable(experience: Experience) -> NDArray[np.int64]:
    """Which actions can be planned with, (k,) row numbers.

    Excluded are actions truncated by the end of the phase, and those with the arm in view before or
    after.
    """
    home = is_home(experience.joint_positions)
    out_of_view = home[experience.preconditions] & home[experience.outcomes]
    return np.flatnonzero(out_of_view & (experience.durations == ACTION_STEPS))
