"""REAL-D: plans over dynamic abstractions of what it went through (paper, section REAL-D)."""

from __future__ import annotations

from functools import partial
from typing import Any

from pydantic import Field

from real_bench.real_x import (
    AbstractionSettings,
    BlurredImages,
    DynamicAbstraction,
    ObjectPositions,
    Perception,
    PlannerSettings,
    RealX,
)
from real_bench.settings import Settings


class ImageSettings(Settings):
    """Settings of the states in image conditions.

    Attributes:
        width, height: of the images, in cells.
        blur: standard deviation of the Gaussian that blurs them, in cells; 0 for none.
    """

    width: int = Field(20, ge=1, le=320)
    height: int = Field(15, ge=1, le=240)
    blur: float = Field(3.0, ge=0)


class RealDSettings(Settings):
    """Settings of REAL-D, part by part."""

    abstraction: AbstractionSettings = AbstractionSettings()
    planner: PlannerSettings = PlannerSettings()
    images: ImageSettings = ImageSettings()


class RealD(RealX):
    """Explores at random; plans at the finest level of abstraction that has a plan.

    States are the objects' positions if these are seen, otherwise images.
    """

    Settings = RealDSettings

    def __init__(self, action_space: Any, observation_space: Any, settings: RealDSettings) -> None:
        super().__init__(
            action_space,
            observation_space,
            perception=_perception(observation_space, settings.images),
            abstractor=partial(DynamicAbstraction.learn, n_levels=settings.abstraction.levels),
            depth=settings.planner.depth,
        )


def _perception(observation_space: Any, images: ImageSettings) -> Perception:
    if "object_positions" in observation_space.spaces:
        return ObjectPositions()
    return BlurredImages(images.width, images.height, images.blur)
