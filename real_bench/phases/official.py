"""What a controller of the official class API sees and commands, as in the official package.

The facts are in ``tests/data/official_calls.json``, recorded with real-robots 0.1.21; deliberate
differences are in ``docs/official-api.md``.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces

from real_bench.controls import Control
from real_bench.observation import Observation

KEYS = (
    "joint_positions",
    "touch_sensors",
    "retina",
    "depth",
    "mask",
    "object_positions",
    "goal",
    "goal_mask",
    "goal_positions",
)
NONE_WITHOUT_GOAL = frozenset({"goal_mask", "goal_positions"})
MAX_FLOAT32 = float(np.finfo(np.float32).max)

log = logging.getLogger(__name__)


def official_space(ours: spaces.Dict) -> spaces.Dict:
    """The space of observations as the official package declares it.

    Its observations do not always fit it: joint positions come as a list, and a goal's mask and
    positions are None in free play.
    """
    official = {key: space for key, space in ours.items() if key in KEYS}
    official["depth"] = spaces.Box(0, 1, ours["depth"].shape, np.float64)
    for key in ("mask", "goal_mask"):
        if key in official:
            official[key] = spaces.Box(0, 255, ours[key].shape, np.int32)
    for key in ("object_positions", "goal_positions"):
        if key in official:
            official[key] = _positions(official[key])
    return spaces.Dict(official)


def official_observation(observation: Observation) -> dict[str, Any]:
    """An observation as the official package gives it, with everything read now."""
    given = set(observation)  # asking whether a key is in it would compute its value
    return {key: _value(observation, key) for key in KEYS if key in given}


class OfficialActions:
    """Reads action dicts as the official package does: unknown keys are ignored.

    Args:
        spec: how the user names the controller, for the warning.
        control: what the commands are for.
    """

    def __init__(self, spec: str, control: Control) -> None:
        self._spec = spec
        self._known = frozenset({*control.keys, "render"})
        self._warned = False

    def drop_unknown_keys(self, action: Any) -> Any:
        """The action without unknown keys, with a warning about the first; a non-dict unchanged."""
        if not isinstance(action, Mapping) or action.keys() <= self._known:
            return action
        if not self._warned:
            self._warned = True
            unknown = ", ".join(sorted(repr(key) for key in action.keys() - self._known))
            log.warning("controller %s: %s in its actions is ignored", self._spec, unknown)
        return {key: value for key, value in action.items() if key in self._known}


def _value(observation: Observation, key: str) -> Any:
    if key in NONE_WITHOUT_GOAL and not observation.has_goal:
        return None
    value = observation[key]
    if key == "joint_positions":
        return value.tolist()
    if key == "depth" and key in observation.dark:
        return np.zeros(value.shape)  # float64; a picture's depth is float32
    return value


def _positions(space: spaces.Space[Any]) -> spaces.Dict:
    assert isinstance(space, spaces.Dict)
    return spaces.Dict(
        {name: spaces.Box(-MAX_FLOAT32, MAX_FLOAT32, (3,), np.float64) for name in space}
    )
