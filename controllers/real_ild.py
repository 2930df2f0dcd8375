"""REAL-ILD: REAL-LD that plays with what it can change (paper, section REAL-ILD)."""

from __future__ import annotations

from functools import partial
from typing import Any

from real_bench.real_x import AbstractionSettings, DynamicAbstraction, PlannerSettings, RealX
from real_bench.real_x.curiosity import Curiosity, CuriositySettings
from real_bench.real_x.latents import Latents, SightSettings


class RealILDSettings(SightSettings):
    """Settings of REAL-ILD, part by part."""

    abstraction: AbstractionSettings = AbstractionSettings()
    planner: PlannerSettings = PlannerSettings()
    curiosity: CuriositySettings = CuriositySettings()


class RealILD(RealX):
    """At play, does what it predicts will change something; plans over latent variables."""

    Settings = RealILDSettings
    uses_images = True

    def __init__(
        self, action_space: Any, observation_space: Any, settings: RealILDSettings
    ) -> None:
        super().__init__(
            action_space,
            observation_space,
            perception=Latents(settings.eye, settings.vae),
            abstractor=partial(DynamicAbstraction.learn, n_levels=settings.abstraction.levels),
            depth=settings.planner.depth,
            curiosity=Curiosity(settings.curiosity),
        )
