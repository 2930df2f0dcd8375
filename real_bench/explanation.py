"""Why a controller chose an action, in a form that the benchmark can keep and draw."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action


@dataclass(frozen=True)
class Explanation:
    """One decision.

    Attributes:
        title: the same in a few words.
        facts: what decided it, as names and plain values (numbers, text, lists); kept as they are.
        actions: what is planned, the action that is done now first; empty where it does nothing.
        positions: where the objects are expected after each planned action, (k, n_objects, 2)
            metres x, y; None where the controller has no positions.
    """

    title: str
    facts: Mapping[str, Any]
    actions: tuple[Action, ...] = ()
    positions: NDArray[np.float64] | None = None
