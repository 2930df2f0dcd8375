"""REAL-GJ: REAL-G that moves its joints; learns by watching its hand where postures put it."""

from __future__ import annotations

from typing import Any

from real_bench.real_g import PlannerSettings, PlaySettings, RealGInJoints, WatchingSettings
from real_bench.settings import Settings


class RealGJSettings(Settings):
    """Settings of REAL-GJ, part by part."""

    watching: WatchingSettings = WatchingSettings()
    play: PlaySettings = PlaySettings()
    planner: PlannerSettings = PlannerSettings()


class RealGJ(RealGInJoints):
    """Watches its hand, then plays with pushes and finds objects in images."""

    Settings = RealGJSettings

    def __init__(self, action_space: Any, observation_space: Any, settings: RealGJSettings) -> None:
        super().__init__(
            action_space, observation_space, settings.watching, settings.play, settings.planner
        )
