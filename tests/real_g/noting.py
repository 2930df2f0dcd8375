"""REAL-GJ that keeps what it saw, depth included, which no recording has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from real_bench.controllers.real_gj import RealGJ

from real_bench.actions import Action

SEEN: list[dict[str, Any]] = []


class Noting(RealGJ):
    """Appends each observation to ``SEEN``."""

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        """As REAL-GJ."""
        keys = ("retina", "depth", "joint_positions")
        SEEN.append({key: np.array(observation[key]) for key in keys})
        action: Action = super().next_action(observation)
        return action
