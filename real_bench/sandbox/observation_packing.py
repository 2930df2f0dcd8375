"""Observations for an isolated controller: only what it does not know already is sent.

Images that the camera did not take are zeros, and everything about the goal stays the same within
one world: neither is sent. ``None`` stands for both.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from gymnasium import spaces

from real_bench.observation import CAMERA_KEYS, GOAL_KEYS, Observation


def pack_observation(observation: Observation, known_world: int) -> dict[str, Any]:
    """An observation without what the child has; ``known_world`` is the last world it knows."""
    known = GOAL_KEYS if observation.world == known_world else frozenset()
    left_out = observation.dark | known
    return {key: None if key in left_out else observation[key] for key in observation}


class Unpacker:
    """Rebuilds observations; no two share any memory."""

    def __init__(self, observation_space: spaces.Dict) -> None:
        # how to make what is not sent: zeros for images, the last values for the goal
        self._has_goal = False
        self._defaults: dict[str, Callable[[], Any]] = {
            key: partial(np.zeros, space.shape, space.dtype)
            for key, space in observation_space.items()
            if key in CAMERA_KEYS
        }

    def unpack(self, message: Mapping[str, Any]) -> Observation:
        """The whole observation."""
        for key in GOAL_KEYS & message.keys():
            if message[key] is not None:
                self._defaults[key] = _copier(message[key])
        if message["goal"] is not None:
            self._has_goal = bool(message["goal"].any())
        dark = frozenset(key for key in CAMERA_KEYS & message.keys() if message[key] is None)
        senses = {
            key: self._defaults[key] if value is None else partial(_identity, value)
            for key, value in message.items()
        }
        return Observation(senses, dark, has_goal=self._has_goal)


def _identity(value: Any) -> Any:
    return value


def _copier(value: Any) -> Callable[[], Any]:
    """A function that copies a value; zeros that nobody reads cost nothing."""
    if isinstance(value, np.ndarray) and not value.any():
        return partial(np.zeros, value.shape, value.dtype)
    kept = copy.deepcopy(value)
    return partial(copy.deepcopy, kept)
