"""REAL-G: plays with goals of its own, learns what a hand can do to objects, plans by that."""

from __future__ import annotations

from typing import Any

from real_bench.real_g import PlannerSettings, PlaySettings, RealG, SeenPoses
from real_bench.settings import Settings


class RealGSettings(Settings):
    """Settings of REAL-G, part by part."""

    play: PlaySettings = PlaySettings()
    planner: PlannerSettings = PlannerSettings()


class RealGSeen(RealG):
    """REAL-G where positions and orientations are seen (conditions OM and OC)."""

    Settings = RealGSettings

    def __init__(self, action_space: Any, observation_space: Any, settings: RealGSettings) -> None:
        super().__init__(
            action_space,
            observation_space,
            perception=SeenPoses(),
            play=settings.play,
            planner=settings.planner,
        )
