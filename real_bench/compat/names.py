"""The official names of conditions."""

from __future__ import annotations

from real_bench.conditions import Condition
from real_bench.controls import CONTROLS
from real_bench.errors import RealBenchError

LEVELS = {"R1": "O", "R2": "I"}
"""The official environments, and what is perceived in them."""

ACTION_TYPES = {control.official_name: letter for letter, control in CONTROLS.items()}


def official_condition(environment: str, action_type: str) -> Condition:
    """The condition of an official environment and action type; raises RealBenchError."""
    if environment not in LEVELS:
        raise RealBenchError(f"environment must be R1 or R2, not {environment!r}")
    if action_type not in ACTION_TYPES:
        raise RealBenchError(
            f"action_type must be one of {', '.join(ACTION_TYPES)}, not {action_type!r}"
        )
    return Condition(LEVELS[environment], ACTION_TYPES[action_type])
