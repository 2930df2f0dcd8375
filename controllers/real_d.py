"""REAL-D: plans over dynamic abstractions of what it went through (paper, section REAL-D)."""

from __future__ import annotations

from functools import partial
from typing import Any

from pydantic import Field

from real_bench.real_x import N_LEVELS, DynamicAbstraction, ObjectPositions, PlannerSettings, RealX
from real_bench.settings import Settings


class AbstractionSettings(Settings):
    """Settings of the Dynamic Abstraction.

    Attributes:
        levels: L, how many levels of abstraction there are.
    """

    levels: int = Field(N_LEVELS, ge=2, le=100_000)


class RealDSettings(Settings):
    """Settings of REAL-D, part by part."""

    abstraction: AbstractionSettings = AbstractionSettings()
    planner: PlannerSettings = PlannerSettings()


class RealD(RealX):
    """Explores at random; plans at the finest level of abstraction that has a plan."""

    Settings = RealDSettings

    def __init__(self, action_space: Any, observation_space: Any, settings: RealDSettings) -> None:
        super().__init__(
            action_space,
            observation_space,
            perception=ObjectPositions(),
            abstractor=partial(DynamicAbstraction.learn, n_levels=settings.abstraction.levels),
            depth=settings.planner.depth,
        )
