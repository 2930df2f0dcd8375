"""Controllers for the extrinsic phase."""

from __future__ import annotations

import os
import random
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from real_bench.actions import Action
from real_bench.controller import BasePolicy, Controller
from real_bench.phases.seeds import derived_seed


def push(number: int) -> Action:
    return Action.macro([[-0.2, 0.4], [0.0, -0.05 * number]])


class Changes(Controller):
    """Its next action depends on how many it has made."""

    def __init__(self, action_space: Any, observation_space: Any) -> None:
        super().__init__(action_space, observation_space)
        self.made: list[int] = []

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        self.made.append(1)
        return push(len(self.made))


class Learns(Changes):
    learns_across_trials = True


class SaysThatItLearns(Changes):
    """As :class:`Learns`, but too late: only when it is made."""

    def __init__(self, action_space: Any, observation_space: Any) -> None:
        super().__init__(action_space, observation_space)
        self.learns_across_trials = True


class GlobalRandomness(BasePolicy):
    """Draws from where official controllers draw, without seeding anything."""

    def step(self, observation: Mapping[str, Any], reward: float, done: bool) -> dict[str, Any]:
        joints = np.array(self.action_space["joint_command"].sample())
        return {"joint_command": joints * np.random.rand() * random.random()}  # noqa: NPY002


def wait_for(path: str) -> None:
    while not Path(path).exists():
        time.sleep(0.005)


class Waits(Changes):
    """In the trials with goals 2 and 3 of a test with seed 0, for a file named ``go``."""

    waits = False

    def seed(self, seed: int) -> None:
        self.waits = seed in (derived_seed(0, 2), derived_seed(0, 3))

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        if self.waits:
            wait_for("go")
        return super().next_action(observation)


class Dies(Changes):
    """Its process ends in the trial with goal 3 of a test with seed 0, when others are done."""

    doomed = False

    def seed(self, seed: int) -> None:
        self.doomed = seed == derived_seed(0, 3)

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        if self.doomed:
            wait_for("score.json")
            os._exit(7)
        return super().next_action(observation)


class FailsOnce(Changes):
    """Raises in the trial with goal 2 of a test with seed 0, once only for each folder."""

    doomed = False

    def seed(self, seed: int) -> None:
        self.doomed = seed == derived_seed(0, 2)

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        if self.doomed and not Path("failed").exists():
            wait_for("score.json")
            Path("failed").touch()
            raise ValueError("no idea")
        return super().next_action(observation)


class DiesInTheSecondTrial(Changes):
    """Its process ends where the trial with goal 1 of a test with seed 0 begins."""

    def seed(self, seed: int) -> None:
        if seed == derived_seed(0, 1):
            os._exit(7)
