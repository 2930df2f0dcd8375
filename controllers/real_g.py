"""REAL-G: plays with its own goals, learns what a hand can do to objects, and plans with that."""

from __future__ import annotations

from typing import Any

from real_bench.real_g import (
    ImagePerception,
    Perception,
    PlannerSettings,
    PlaySettings,
    PosePerception,
    Primitive,
    RealG,
    primitive_of,
)
from real_bench.settings import Settings


class RealGSettings(Settings):
    """Settings of REAL-G, part by part."""

    play: PlaySettings = PlaySettings()
    planner: PlannerSettings = PlannerSettings()


class RealGSeen(RealG):
    """REAL-G with a hand or macros; finds objects in images if their positions are not given."""

    Settings = RealGSettings

    def __init__(self, action_space: Any, observation_space: Any, settings: RealGSettings) -> None:
        primitive = primitive_of(action_space)
        super().__init__(
            action_space,
            observation_space,
            primitive=primitive,
            perception=_perception(primitive, observation_space),
            play=settings.play,
            planner=settings.planner,
        )


def _perception(primitive: Primitive, observation_space: Any) -> Perception:
    if "object_positions" in observation_space.spaces:
        return PosePerception()
    ends = list(primitive.end)
    return ImagePerception(primitive.low[ends], primitive.high[ends])
