"""Observations on their way to an isolated controller: only what it cannot know already.

Images that the camera did not take are zeros, and what is said of the goal stays the same within
one world: neither is sent. ``None`` stands for both.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces

from real_bench.observation import GOAL_KEYS, Observation


def packed(observation: Observation, world_told: int) -> dict[str, Any]:
    """An observation without what the child has; ``world_told`` is the last it was told of."""
    known = GOAL_KEYS if observation.world == world_told else frozenset()
    left_out = observation.dark | known
    return {key: None if key in left_out else observation[key] for key in observation}


class Unpacker:
    """Puts observations together again."""

    def __init__(self, observation_space: spaces.Dict) -> None:
        self._space = observation_space
        self._goal: dict[str, Any] = {}

    def unpacked(self, told: Mapping[str, Any]) -> dict[str, Any]:
        """The whole observation; nothing in it is shared with any other."""
        whole = dict(told)
        for key, value in told.items():
            if key in GOAL_KEYS:
                if value is not None:
                    self._goal[key] = value
                whole[key] = copy.deepcopy(self._goal[key])
            elif value is None:
                space = self._space[key]
                whole[key] = np.zeros(space.shape or (), space.dtype)
        return whole
