"""A controller in our own process."""

from __future__ import annotations

import copy
import random
import sys
from collections.abc import Callable, Mapping
from typing import Any, cast

import numpy as np

from real_bench.actions import Action, Command, check_action, wants_render
from real_bench.errors import ActionError, ControllerError, PhysicsError
from real_bench.explanation import Explanation
from real_bench.finding import (
    blame,
    find_controller,
    is_action_level,
    says_enough,
    source_file,
    source_sha256,
)
from real_bench.phases.guest import Identity, Terms, fault
from real_bench.recording import Experience, State
from real_bench.settings import check_settings, settings_in_full


class LocalHost:
    """Has controllers in our own process, with all that it can reach."""

    def identity(self, spec: str, settings: Mapping[str, Any] | None) -> Identity:
        """What the controller is; raises ControllerError."""
        return identify(find_controller(spec), spec, settings)

    def guest(self, spec: str, settings: Mapping[str, Any], task: Terms) -> LocalGuest:
        """The controller, made; raises ControllerError."""
        return LocalGuest(spec, find_controller(spec), settings, task)


def identify(kind: type[Any], spec: str, settings: Mapping[str, Any] | None) -> Identity:
    """What a class is; raises ControllerError for bad settings, unless these are not asked for."""
    return Identity(
        class_name=kind.__qualname__,
        source_sha256=source_sha256(kind),
        action_level=is_action_level(kind),
        uses_images=bool(getattr(kind, "uses_images", False)),
        learns_across_trials=_learns_across_trials(kind),
        settings={} if settings is None else settings_in_full(kind, spec, settings),
    )


class LocalGuest:
    """A controller with its errors turned into ours, and missing hooks into nothing.

    Args:
        spec: how the user names it, for messages.
        kind: its class.
        settings: values for its settings, if it has any.
        terms: what it is made with.
    """

    def __init__(
        self, spec: str, kind: type[Any], settings: Mapping[str, Any], terms: Terms
    ) -> None:
        self.spec = spec
        self.identity = identify(kind, spec, settings)
        self._control = terms.control
        file = source_file(kind)
        self._file = str(file) if file else None
        # Its own spaces: sampling from them is part of its randomness.
        self._action_space = copy.deepcopy(terms.action_space)
        checked = check_settings(kind, spec, settings)
        arguments = (self._action_space, terms.observation_space)
        self._controller = self._guarded(kind, *arguments, *([checked] if checked else []))
        if _learns_across_trials(self._controller) != self.identity.learns_across_trials:
            raise fault(self, "learns_across_trials must be set on the class, not on the instance")

    def call(self, hook: str, *arguments: Any) -> Any:
        """Call a method, or do nothing where there is none; raises ControllerError."""
        bound = getattr(self._controller, hook, None)
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

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        """The next whole action; it can be executed."""
        action = self.call("next_action", observation)
        try:
            return check_action(action, self._control)
        except ActionError as error:
            raise fault(self, f"next_action() returned a bad action: {error}") from error

    def step(self, observation: Mapping[str, Any]) -> tuple[Command, bool]:
        """The next step's command, and whether images are wanted."""
        action = self.call("step", dict(observation), 0.0, False)
        try:
            return self._control.command(action), wants_render(action)
        except ActionError as error:
            raise fault(self, f"step() returned a bad action: {error}") from error
        except (Exception, SystemExit) as error:  # a stranger's object may raise anything
            raise fault(self, f"step() returned a bad action: {blame(error)}") from error

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
            raise fault(self, "it has get_state() but no set_state()")
        self.call("set_state", state)

    def use_experience(self, experience: Experience) -> None:
        """Give it the triplets of the intrinsic phase."""
        self.call("use_experience", experience)

    def explain(self) -> Explanation | None:
        """Why it chose its last action, where it says so."""
        explanation = self.call("explain")
        if explanation is not None and not isinstance(explanation, Explanation):
            raise fault(
                self, f"explain() must return an Explanation, not {type(explanation).__name__}"
            )
        return explanation

    def copy(self) -> LocalGuest:
        """An independent copy of the controller as it is now."""
        twin = copy.copy(self)
        try:
            pair = copy.deepcopy((self._controller, self._action_space))
        except Exception as error:
            raise fault(
                self,
                f"cannot be copied for each goal ({blame(error, self._file)}): define "
                "__deepcopy__, or set learns_across_trials",
            ) from error
        twin._controller, twin._action_space = pair
        return twin

    def close(self) -> None:
        """Nothing is held that would have to be let go."""

    def _guarded(self, function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except PhysicsError:
            raise  # of the world that it looks at, not its own
        except (Exception, SystemExit) as error:
            if says_enough(error, self._file):
                raise fault(self, str(error)) from error
            name = getattr(function, "__name__", "it")
            raise fault(self, f"{name}() failed at {blame(error, self._file)}") from error


def _learns_across_trials(controller: object) -> bool:
    return bool(getattr(controller, "learns_across_trials", False))
