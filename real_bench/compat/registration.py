"""The official environments under their official ids, also for gym if it is installed."""

from __future__ import annotations

import importlib.util
import logging
from typing import Any

import gymnasium

from real_bench.compat.names import ACTION_TYPES, LEVELS

ENTRY_POINT = "real_bench.compat.environment:REALRobotEnv"

log = logging.getLogger(__name__)


def register() -> None:
    """Register ``REALRobot2020-R1J1-v0`` to ``R2M3`` with gymnasium, and with gym if installed."""
    for name, kwargs in _environments().items():
        # The environment has the official interface, which gymnasium's wrappers do not know.
        gymnasium.register(
            name,
            ENTRY_POINT,
            kwargs=kwargs,
            disable_env_checker=True,
            order_enforce=False,
        )
    if importlib.util.find_spec("gym") is not None:
        _register_with_gym()


def _register_with_gym() -> None:
    try:
        registration = importlib.import_module("gym.envs.registration")
    except Exception as error:  # an old gym may fail beside a new numpy in many ways
        log.warning("gym is installed but cannot be imported (%s): use gymnasium", error)
        return
    plain = {"disable_env_checker": True, "order_enforce": False}
    for name, kwargs in _environments().items():
        try:
            registration.register(name, entry_point=ENTRY_POINT, kwargs=kwargs, **plain)
        except TypeError:  # gym before 0.22 has neither
            registration.register(name, entry_point=ENTRY_POINT, kwargs=kwargs)


def _environments() -> dict[str, dict[str, Any]]:
    return {
        f"REALRobot2020-{level}{control}{objects}-v0": {
            "additional_obs": perception == "O",
            "objects": objects,
            "action_type": action_type,
        }
        for objects in (1, 2, 3)
        for level, perception in LEVELS.items()
        for action_type, control in ACTION_TYPES.items()
    }
