"""Whether an arm is out of the camera's way (paper, section REAL-LD: joint actions)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

AWAY_RADIANS = 0.1
"""How far a joint may be from the home posture, where every angle is 0, for the arm not to be seen.

With joint actions the 150 steps at the end are not always enough to come home. Measured on images
after which no object had moved: beyond 0.1 they differ in hundreds of pixels, below in single ones.
"""


def is_home(joint_positions: ArrayLike) -> NDArray[np.bool_]:
    """Whether the robot is home, (..., 9) radians to (...)."""
    return np.asarray((np.abs(joint_positions) < AWAY_RADIANS).all(axis=-1))
