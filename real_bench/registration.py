"""Register the environments with Gymnasium."""

from __future__ import annotations

import gymnasium

from real_bench.conditions import CONDITION_NAMES


def register() -> None:
    """Register ``RealBench/REAL-OM-v0`` and its siblings, and ``RealBench/REAL-OM-Action-v0``."""
    for condition in CONDITION_NAMES:
        if condition.endswith("M"):
            gymnasium.register(
                id=f"RealBench/REAL-{condition}-Action-v0",
                entry_point="real_bench.action_environment:ActionEnv",
                kwargs={"condition": condition},
            )
        gymnasium.register(
            id=f"RealBench/REAL-{condition}-v0",
            entry_point="real_bench.environment:RealEnv",
            kwargs={"condition": condition},
        )
