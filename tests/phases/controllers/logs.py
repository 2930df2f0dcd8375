"""Controllers that note numbers of their own."""

from __future__ import annotations

import math

from real_bench.controllers.real_r import RealR


class Logs(RealR):
    """Notes the number of each action, and in the end of how many it learned."""

    n_actions = 0

    def get_state(self):
        return {**super().get_state(), "n_actions": self.n_actions}

    def set_state(self, state):
        super().set_state(state)
        self.n_actions = state["n_actions"]

    def start_intrinsic_phase(self):
        self.log("begun", 1)

    def next_action(self, observation):
        self.n_actions += 1
        self.log("actions", self.n_actions)
        if self.n_actions % 2:
            self.log("verlust ö", math.nan if self.n_actions == 3 else 1 / self.n_actions)
        return super().next_action(observation)

    def use_experience(self, experience):
        for epoch in range(3):
            self.log("epoch", epoch)


class AllAttributes(Logs):
    """Hands over every attribute that is plain data."""

    def get_state(self):
        live = ("action_space", "observation_space", "_random", "_explorer")
        plain = {name: value for name, value in vars(self).items() if name not in live}
        return {**super().get_state(), **plain}


class Endless(RealR):
    """Notes more than can wait."""

    def next_action(self, observation):
        for number in range(30_000):
            self.log("x", number)
        return super().next_action(observation)


class LongName(RealR):
    def next_action(self, observation):
        self.log("x" * 65, 1.0)


class NoNumber(RealR):
    def next_action(self, observation):
        self.log("x", "three")


class OwnLog(RealR):
    """Has something else of that name."""

    def log(self, *arguments):
        self.said = arguments

    def next_action(self, observation):
        self.log("x", "y", "z")
        return super().next_action(observation)
