"""The environments as Gymnasium knows them."""

from __future__ import annotations

import gymnasium

from real_bench.conditions import CONDITION_NAMES


def register() -> None:
    """Register ``RealBench/REAL-OM-v0`` and its siblings."""
    for condition in CONDITION_NAMES:
        gymnasium.register(
            id=f"RealBench/REAL-{condition}-v0",
            entry_point="real_bench.environment:RealEnv",
            kwargs={"condition": condition},
        )
