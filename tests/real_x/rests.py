"""A controller to compare with: it does nothing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from real_bench.actions import Action
from real_bench.controller import Controller


class Rests(Controller):
    def next_action(self, observation: Mapping[str, Any]) -> Action:
        return Action.rest(4 if "macro_action" in self.action_space.spaces else 9)
