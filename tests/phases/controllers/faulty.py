"""Controllers that go wrong, at their third action or at their 1,500th step."""

from __future__ import annotations

import json
import signal
import sys
import threading
from typing import Any

import numpy as np

from real_bench.actions import Action
from real_bench.controller import Controller

MACRO = [[-0.1, 0.3], [-0.1, -0.3]]


class ByActions(Controller):
    n_actions = 0

    def next_action(self, observation: Any) -> Any:
        self.n_actions += 1
        self.observation = observation
        return self.go_wrong() if self.n_actions == 3 else Action.macro(MACRO)

    def go_wrong(self) -> Any:
        raise NotImplementedError


class BySteps(Controller):
    n_steps = 0

    def step(self, observation: Any, reward: float, done: bool) -> Any:
        self.n_steps += 1
        return self.go_wrong() if self.n_steps == 1500 else {"macro_action": MACRO}

    def go_wrong(self) -> Any:
        raise NotImplementedError


class Raises(ByActions):
    def go_wrong(self) -> Any:
        raise ValueError("one line\nand another")


class Exits(ByActions):
    def go_wrong(self) -> Any:
        sys.exit(0)


class FailsInALibrary(ByActions):
    def go_wrong(self) -> Any:
        json.loads("{")


class Recurses(ByActions):
    def go_wrong(self) -> Any:
        return self.go_wrong()


class StepRaises(BySteps):
    def go_wrong(self) -> Any:
        raise ValueError("no idea")


class StepExits(BySteps):
    def go_wrong(self) -> Any:
        sys.exit("enough")


class MakesABadAction(ByActions):
    def go_wrong(self) -> Any:
        return Action.macro([1, 2, 3])


class ReadsThePast(ByActions):
    def next_action(self, observation: Any) -> Any:
        if self.n_actions == 2:
            return self.go_wrong()
        return super().next_action(observation)

    def go_wrong(self) -> Any:
        return self.observation["joint_positions"]


class GivesNone(ByActions):
    def go_wrong(self) -> Any:
        return None


class GivesADict(ByActions):
    def go_wrong(self) -> Any:
        return {"macro_action": MACRO}


class GivesNaN(ByActions):
    def go_wrong(self) -> Any:
        return Action.hold([0, np.nan, 0, 0], 1000)


class GivesInfinity(ByActions):
    def go_wrong(self) -> Any:
        return Action.hold([0, np.inf, 0, 0], 1000)


class GivesTooMany(ByActions):
    def go_wrong(self) -> Any:
        return Action.hold(np.zeros(9), 1000)


class GivesALine(ByActions):
    def go_wrong(self) -> Any:
        return Action(np.zeros((1, 4)), np.array([10]), np.array([True]))


class StepGivesNone(BySteps):
    def go_wrong(self) -> Any:
        return None


class StepGivesNaN(BySteps):
    def go_wrong(self) -> Any:
        return {"macro_action": np.full((2, 2), np.nan)}


class StepGivesTooFew(BySteps):
    def go_wrong(self) -> Any:
        return {"macro_action": [0, 1]}


class StepGivesAnotherKey(BySteps):
    def go_wrong(self) -> Any:
        return {"joint_command": np.zeros(9)}


class StepGivesText(BySteps):
    def go_wrong(self) -> Any:
        return {"macro_action": "left"}


class StepGivesTooLargeNumbers(BySteps):
    def go_wrong(self) -> Any:
        return {"macro_action": [[10**400] * 2] * 2}


class StepGivesRaggedRender(BySteps):
    def go_wrong(self) -> Any:
        return {"macro_action": MACRO, "render": [0, [1, 2]]}


class StepGivesATensorThatNeedsGradients(BySteps):
    def go_wrong(self) -> Any:
        return {"macro_action": Tensor()}


class Tensor:
    """Refuses to be an array, as PyTorch's do."""

    def __array__(self, *arguments: Any, **options: Any) -> Any:
        raise RuntimeError("Can't call numpy() on Tensor that requires grad.")


class StateIsNoDict(ByActions):
    def get_state(self) -> Any:
        return [1, 2]


class StateFails(ByActions):
    def get_state(self) -> Any:
        return {"x": 1 / 0}


class StateCannotBeKept(ByActions):
    def get_state(self) -> Any:
        return {"x": {1, 2}}


class StateCannotBeCopied(ByActions):
    def get_state(self) -> Any:
        return {"x": threading.Lock()}


class NoBasePolicy:
    """Has nothing but what it must have."""

    def __init__(self, action_space: Any, observation_space: Any) -> None:
        pass

    def step(self, observation: Any, reward: float, done: bool) -> Any:
        return {"macro_action": MACRO}


class FailsTwice(Controller):
    """In a trial, and again when it is told that the tests are over."""

    learns_across_trials = True

    def next_action(self, observation: Any) -> Any:
        raise ValueError("the first reason")

    def end_extrinsic_phase(self) -> None:
        raise ValueError("the second reason")


class StoppedEarly(Controller):
    """Ctrl-C is pressed while it gets ready."""

    def start_intrinsic_phase(self) -> None:
        signal.raise_signal(signal.SIGINT)

    def next_action(self, observation: Any) -> Any:
        return Action.macro(MACRO)
