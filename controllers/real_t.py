"""REAL-T: REAL-D with thresholds set by hand (paper, section REAL-D, REAL-T)."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from real_bench.errors import ControllerError
from real_bench.real_x import DynamicAbstraction, ObjectPositions, PlannerSettings, RealX, Triplets
from real_bench.settings import Settings

Metres = Annotated[float, Field(gt=0)]


class RealTSettings(Settings):
    """Settings of REAL-T.

    Attributes:
        thresholds: in x and y, metres, the same for each object; the default is the paper's best.
        planner: settings of the planner.
    """

    thresholds: tuple[Metres, Metres] = (0.02, 0.04)
    planner: PlannerSettings = PlannerSettings()


class RealT(RealX):
    """Explores at random; plans at one level of abstraction, with fixed thresholds."""

    Settings = RealTSettings

    def __init__(self, action_space: Any, observation_space: Any, settings: RealTSettings) -> None:
        def abstractor(triplets: Triplets) -> DynamicAbstraction:
            return DynamicAbstraction.fixed(
                np.tile(settings.thresholds, triplets.n_variables // len(settings.thresholds))
            )

        if "object_positions" not in observation_space.spaces:
            raise ControllerError("its thresholds are for positions: use an O condition")
        super().__init__(
            action_space,
            observation_space,
            perception=ObjectPositions(),
            abstractor=abstractor,
            depth=settings.planner.depth,
        )
