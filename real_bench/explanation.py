"""Why a controller chose an action, in a form that the benchmark can keep and draw."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action
from real_bench.errors import ActionError


@dataclass(frozen=True, eq=False)
class Explanation:
    """One decision.

    Attributes:
        title: the decision in a few words.
        facts: what decided it, as names and plain values (numbers, text, lists); kept as they are.
        actions: the plan, beginning with the action done now; empty if it does nothing.
        positions: where the objects are expected after each planned action, (k, n_objects, 2)
            metres x, y; None if the controller has no positions.
    """

    title: str
    facts: Mapping[str, Any]
    actions: tuple[Action, ...] = ()
    positions: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.facts, Mapping):
            raise ActionError(f"facts must be names and values, not {type(self.facts).__name__}")
        if not all(isinstance(action, Action) for action in self.actions):
            raise ActionError("the actions of an explanation must be instances of Action")
        if self.positions is not None:
            positions = np.asarray(self.positions, np.float64)
            object.__setattr__(self, "positions", positions)
            if positions.ndim != 3 or positions.shape[2] != 2 or not np.isfinite(positions).all():
                raise ActionError(
                    f"positions must be finite numbers (k, n_objects, 2), not {positions.shape}"
                )
