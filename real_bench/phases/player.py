"""Let a controller play: ask it for commands, execute them, keep what was executed."""

from __future__ import annotations

import copy
import random
import sys
from collections.abc import Callable, Mapping
from typing import Any, Protocol, cast

import numpy as np

from real_bench.actions import ACTION_STEPS, Action, Command, check_action, wants_render
from real_bench.errors import ActionError, ControllerError, PhysicsError
from real_bench.explanation import Explanation
from real_bench.finding import blame, is_action_level, says_enough, source_file
from real_bench.recording import Experience, State
from real_bench.settings import check_settings
from real_bench.task import Task


class Player(Protocol):
    """A controller at play in a task."""

    def play(self, n_steps_left: int) -> Action:
        """One action, executed; at most ``n_steps_left`` steps of it. Returns what was done."""


class Guest:
    """A controller with its errors turned into ours, and missing hooks into nothing.

    Args:
        spec: how the user names it, for messages.
        kind: its class.
        task: whose spaces it is made with.
        settings: values for its settings, if it has any.
    """

    def __init__(
        self, spec: str, kind: type[Any], task: Task, settings: Mapping[str, Any] | None = None
    ) -> None:
        self.spec = spec
        self.action_level = is_action_level(kind)
        file = source_file(kind)
        self._file = str(file) if file else None
        # Its own spaces: sampling from them is part of its randomness.
        self._action_space = copy.deepcopy(task.action_space)
        checked = check_settings(kind, spec, settings or {})
        arguments = (self._action_space, task.observation_space)
        self._controller = self._guarded(kind, *arguments, *([checked] if checked else []))
        self.learns_across_trials = learns_across_trials(kind)
        if learns_across_trials(self._controller) != self.learns_across_trials:
            raise self.fault("learns_across_trials must be set on the class, not on the instance")

    def call(self, method: str, *arguments: Any) -> Any:
        """Call a method, or do nothing where there is none; raises ControllerError."""
        bound = getattr(self._controller, method, None)
        if not callable(bound):  # an official controller may have a number called `seed`
            return None
        return self._guarded(bound, *arguments)

    def seed(self, seed: int) -> None:
        """Seed the controller, and what controllers draw from without being asked to."""
        numpy_seed = seed % 2**32
        np.random.seed(numpy_seed)  # noqa: NPY002  the official controllers use it
        random.seed(seed)
        if "torch" in sys.modules:
            sys.modules["torch"].manual_seed(seed)
        self._action_space.seed(numpy_seed)
        self.call("seed", seed)

    def get_state(self) -> State:
        """What the controller hands over, its own copy."""
        state = self.call("get_state")
        if state is None:  # a class of its own, without the method
            return {}
        if not isinstance(state, dict):
            raise ControllerError(
                f"controller {self.spec}: get_state() must return a dict, "
                f"not {type(state).__name__}"
            )
        return cast(State, self._guarded(copy.deepcopy, state))

    def set_state(self, state: State) -> None:
        """Go on from a state; an empty one is none."""
        if not state:
            return
        if not callable(getattr(self._controller, "set_state", None)):
            raise self.fault("it has get_state() but no set_state()")
        self.call("set_state", state)

    def use_experience(self, experience: Experience) -> None:
        """Give it the triplets of the intrinsic phase."""
        self.call("use_experience", experience)

    def explain(self) -> Explanation | None:
        """Why it chose its last action, where it says so."""
        explanation = self.call("explain")
        if explanation is not None and not isinstance(explanation, Explanation):
            raise self.fault(
                f"explain() must return an Explanation, not {type(explanation).__name__}"
            )
        return explanation

    def copy(self) -> Guest:
        """An independent copy of the controller as it is now."""
        twin = copy.copy(self)
        try:
            pair = copy.deepcopy((self._controller, self._action_space))
        except Exception as error:
            raise self.fault(
                f"cannot be copied for each goal ({blame(error, self._file)}): define "
                "__deepcopy__, or set learns_across_trials"
            ) from error
        twin._controller, twin._action_space = pair
        return twin

    def at_play(self, task: Task) -> Player:
        """Begin to play in a task, which must have begun."""
        return ActionPlayer(self, task) if self.action_level else StepPlayer(self, task)

    def fault(self, what: str) -> ControllerError:
        """An error that names the controller."""
        return ControllerError(f"controller {self.spec}: {what}")

    def _guarded(self, function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except PhysicsError:
            raise  # of the world that it looks at, not its own
        except (Exception, SystemExit) as error:
            if says_enough(error, self._file):
                raise self.fault(str(error)) from error
            name = getattr(function, "__name__", "it")
            raise self.fault(f"{name}() failed at {blame(error, self._file)}") from error


def learns_across_trials(controller: object) -> bool:
    """Whether a controller, or its class, goes on learning from trial to trial."""
    return bool(getattr(controller, "learns_across_trials", False))


class ActionPlayer:
    """Plays a controller that decides on whole actions."""

    def __init__(self, guest: Guest, task: Task) -> None:
        self._guest = guest
        self._task = task

    def play(self, n_steps_left: int) -> Action:
        """Ask for the next action and execute it in the fast loop."""
        action = self._guest.call("next_action", self._task.observe())
        try:
            checked = check_action(action, self._task.control).first(n_steps_left)
        except ActionError as error:
            raise self._guest.fault(f"next_action() returned a bad action: {error}") from error
        self._task.execute(checked)
        return checked


class StepPlayer:
    """Plays a controller that is called at every step, a stretch of 1000 steps at a time."""

    def __init__(self, guest: Guest, task: Task) -> None:
        self._guest = guest
        self._task = task
        self._observation: Mapping[str, Any] = task.observe().now()

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

    def _step(self) -> Command:
        action = self._guest.call("step", self._observation, 0.0, False)
        try:
            command = self._task.control.command(action)
            render = wants_render(action)
        except ActionError as error:
            raise self._guest.fault(f"step() returned a bad action: {error}") from error
        self._task.step(command)
        self._observation = self._task.observe(render=render).now()
        return command
