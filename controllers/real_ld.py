"""REAL-LD: plans over what a VAE makes of images (paper, section REAL-LD)."""

from __future__ import annotations

from functools import partial
from typing import Any

from real_bench.real_x import AbstractionSettings, DynamicAbstraction, PlannerSettings, RealX
from real_bench.real_x.latents import Latents, SightSettings


class RealLDSettings(SightSettings):
    """Settings of REAL-LD, part by part."""

    abstraction: AbstractionSettings = AbstractionSettings()
    planner: PlannerSettings = PlannerSettings()


class RealLD(RealX):
    """Explores at random; learns to see at the end of free play; plans over latent variables."""

    Settings = RealLDSettings
    uses_images = True

    def __init__(self, action_space: Any, observation_space: Any, settings: RealLDSettings) -> None:
        super().__init__(
            action_space,
            observation_space,
            perception=Latents(settings.eye, settings.vae),
            abstractor=partial(DynamicAbstraction.learn, n_levels=settings.abstraction.levels),
            depth=settings.planner.depth,
        )
