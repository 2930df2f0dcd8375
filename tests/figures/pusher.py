"""A controller that moves the cube to and fro."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from real_bench.actions import Action
from real_bench.controller import Controller, ControllerState


class Pusher(Controller):
    n_actions = 0

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        self.n_actions += 1
        side = (-1) ** self.n_actions
        self.log("side", side)
        self.log("way (m)", 0.02 * self.n_actions)
        return Action.macro([(-0.1, 0.35 * side), (-0.1, -0.02 * self.n_actions * side)])

    def get_state(self) -> ControllerState:
        return {"n_actions": self.n_actions}

    def set_state(self, state: ControllerState) -> None:
        self.n_actions = state["n_actions"]
