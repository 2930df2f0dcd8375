"""Let a controller play: ask it for commands, execute them, keep what was executed."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from real_bench.actions import ACTION_STEPS, Action, Command
from real_bench.observation import Observation
from real_bench.phases.proxy import ControllerProxy
from real_bench.task import Task


class Player(Protocol):
    """A controller at play in a task."""

    def play(self, n_steps_left: int) -> Action:
        """One action, executed; at most ``n_steps_left`` steps of it. Returns what was done."""

    def look(self) -> Observation:
        """What is seen now; a controller called at every step gets images only if it asked."""


DecisionContext = Callable[[], AbstractContextManager[object]]
"""Gives a context that lasts while the controller decides."""


def make_player(
    proxy: ControllerProxy, task: Task, decision_context: DecisionContext = nullcontext
) -> Player:
    """Begin to play in a task, which must have begun."""
    kind = ActionPlayer if proxy.identity.action_level else StepPlayer
    return kind(proxy, task, decision_context)


@dataclass
class ActionPlayer:
    """Plays a controller that decides on whole actions."""

    proxy: ControllerProxy
    task: Task
    decision_context: DecisionContext

    def play(self, n_steps_left: int) -> Action:
        """Ask for the next action and execute it in the fast loop."""
        with self.decision_context():
            action = self.proxy.next_action(self.look()).first(n_steps_left)
        self.task.execute(action)
        return action

    def look(self) -> Observation:
        """What is seen now; images are there for whoever reads them."""
        return self.task.observe()


@dataclass
class StepPlayer:
    """Plays a controller that is called at every step, a stretch of 1000 steps at a time."""

    proxy: ControllerProxy
    task: Task
    decision_context: DecisionContext
    _render: bool = field(default=True, init=False)  # the first observation has images

    def play(self, n_steps_left: int) -> Action:
        """A stretch of steps; equal commands in a row are kept as one."""
        commands: list[Command] = []
        durations: list[int] = []
        for _ in range(min(ACTION_STEPS, n_steps_left)):
            command = self._step()
            if commands and command.tobytes() == commands[-1].tobytes():
                durations[-1] += 1
            else:
                commands.append(command)
                durations.append(1)
        return Action(np.array(commands), np.array(durations), np.zeros(len(commands), bool))

    def look(self) -> Observation:
        """What is seen now, with images where the last action asked for them."""
        return self.task.observe(render=self._render)

    def _step(self) -> Command:
        with self.decision_context():
            command, self._render = self.proxy.step(self.look())
        self.task.step(command)
        return command
