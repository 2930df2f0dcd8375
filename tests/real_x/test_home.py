from __future__ import annotations

import numpy as np

from real_bench.real_x.home import HOME_TOLERANCE_RAD, is_home


def test_is_home_checks_every_joint() -> None:
    joints = np.zeros((10, 9))
    joints[np.arange(9), np.arange(9)] = -2 * HOME_TOLERANCE_RAD
    assert is_home(joints).tolist() == [False] * 9 + [True]
