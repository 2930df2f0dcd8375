"""REAL-R: random actions, the baseline (paper, section REAL-X architectures)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from real_bench.actions import Action
from real_bench.controller import Controller, ControllerState
from real_bench.real_x import RandomExplorer


class RealR(Controller):
    """Follows the random explorer, both at play and in tests."""

    def __init__(self, action_space: Any, observation_space: Any) -> None:
        super().__init__(action_space, observation_space)
        self.seed(0)

    def seed(self, seed: int) -> None:
        """Begin the random sequence of this seed."""
        self._random = np.random.default_rng(seed)
        self._explorer = RandomExplorer(self.action_space, self._random)

    def get_state(self) -> ControllerState:
        """Its place in its random sequence."""
        return {"random": self._random.bit_generator.state}

    def set_state(self, state: ControllerState) -> None:
        """Continue the random sequence."""
        self._random.bit_generator.state = state["random"]

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        """A random action of 1000 steps, whatever it sees."""
        return self._explorer.next_action()
