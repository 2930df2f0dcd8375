"""The environments as Gymnasium knows them; cheap to import, Gymnasium loads it by itself."""

from __future__ import annotations

from real_bench.conditions import CONDITION_NAMES


def register() -> None:
    """Register ``REAL-OM-v0`` and its siblings.

    Gymnasium calls this through its plugin entry point, inside the namespace ``RealBench``.
    """
    import gymnasium

    for condition in CONDITION_NAMES:
        gymnasium.register(
            id=f"REAL-{condition}-v0",
            entry_point="real_bench.environment:RealEnv",
            kwargs={"condition": condition},
        )
