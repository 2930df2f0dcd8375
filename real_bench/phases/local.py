"""A controller in this process."""

from __future__ import annotations

import copy
import os
import random
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, cast

import numpy as np

from real_bench.actions import Action, Command, check_action, wants_render
from real_bench.controller import Controller
from real_bench.controller_code.blame import blame, is_self_explanatory
from real_bench.controller_code.finding import (
    find_controller,
    is_action_level,
    misspelt_hooks,
    overrides_hook,
    source_file,
    uses_extended_api,
)
from real_bench.controller_code.independence import shared_through
from real_bench.controller_code.requirements import packages_of
from real_bench.controller_code.signatures import accepts, misfit
from real_bench.controller_code.source import ControllerSource
from real_bench.errors import (
    ActionError,
    ControllerDeclinedError,
    ControllerError,
    PhysicsError,
)
from real_bench.explanation import Explanation
from real_bench.logbook import Entry, take_entries
from real_bench.observation import Observation, missing_key
from real_bench.phases.official import OfficialActions, official_observation, official_space
from real_bench.phases.proxy import NO_FILES, ControllerContext, Identity, fault
from real_bench.recording import ControllerState
from real_bench.settings import check_settings, merged, settings_in_full

OFFICIAL_HOOKS = frozenset(
    f"{when}_{phase}"
    for when in ("start", "end")
    for phase in ("intrinsic_phase", "extrinsic_phase", "extrinsic_trial")
)
"""The hooks of the official class API; those of ours are for classes derived from Controller."""


class LocalBackend:
    """Runs controllers in this process, with access to all that it can reach."""

    def identity(self, spec: str, settings: Mapping[str, Any] | None) -> Identity:
        """What the controller is; raises ControllerError."""
        kind, source = _load_controller(spec)
        return identify(kind, source, settings)

    def proxy(
        self,
        spec: str,
        settings: Mapping[str, Any],
        task: ControllerContext,
        files: Mapping[str, bytes] = NO_FILES,
    ) -> LocalProxy:
        """The controller, made; raises ControllerError."""
        if files:
            raise ControllerError(
                f"controller {spec}: it played in isolation and wrote {', '.join(sorted(files))}: "
                "use --isolate to give it these files back"
            )
        kind, source = _load_controller(spec)
        return LocalProxy(source, kind, settings, task)


def _load_controller(spec: str) -> tuple[type[Any], ControllerSource]:
    """A controller's class and its source; its packages are installed before it is imported."""
    source = ControllerSource.of(spec)
    if source.submission is not None:
        packages = packages_of(source.submission)
        if packages is not None and str(packages) not in sys.path:
            sys.path.append(str(packages))
    return find_controller(spec), source


def identify(
    kind: type[Any], source: ControllerSource, settings: Mapping[str, Any] | None
) -> Identity:
    """What a class is; raises ControllerError for bad settings; None: ignore the settings."""
    return Identity(
        class_name=kind.__qualname__,
        file=str(source_file(kind) or ""),
        code_sha256=source.code_sha256,
        action_level=is_action_level(kind),
        uses_images=bool(getattr(kind, "uses_images", False)),
        learns_across_trials=_learns_across_trials(kind),
        learns_from_experience=overrides_hook(kind, "use_experience"),
        hands_over_state=overrides_hook(kind, "get_state"),
        takes_state=overrides_hook(kind, "set_state"),
        settings=(
            {}
            if settings is None
            else settings_in_full(kind, source.spec, merged(source.settings, settings))
        ),
        misspelt=tuple(f"{name} (did you mean {meant}?)" for name, meant in misspelt_hooks(kind)),
    )


class OwnFolder:
    """The working directory of a controller: ours, until it changes it; ours stays as it is."""

    def __init__(self) -> None:
        self._own: str | None = None

    def enter(self) -> str | None:
        """Go there; returns ours."""
        ours = _folder_now()
        if self._own is not None:
            with suppress(OSError):  # it may be gone
                os.chdir(self._own)
        return ours

    def leave(self, ours: str | None) -> None:
        """Go back."""
        own = _folder_now()
        if ours is not None and own != ours:
            os.chdir(ours)
        self._own = own if own != ours else None


def _folder_now() -> str | None:
    """The working directory, if it still exists."""
    try:
        return os.getcwd()  # noqa: PTH109  at each step, and faster
    except OSError:
        return None


class LocalProxy:
    """A controller with its errors turned into ours, and missing hooks into nothing.

    Args:
        source: what the user names it by, and where its code lies.
        kind: its class.
        settings: values for its settings, if it has any.
        context: what it is made with.
    """

    def __init__(
        self,
        source: ControllerSource,
        kind: type[Any],
        settings: Mapping[str, Any],
        context: ControllerContext,
    ) -> None:
        self.spec = source.spec
        self.identity = identify(kind, source, settings)
        self._control = context.control
        self._place = source.place
        self._folder = OwnFolder()
        self._observed = tuple(context.observation_space.spaces)
        self._has_extended_api = uses_extended_api(kind)
        # Its own spaces: sampling from them is part of its randomness.
        self._action_space = copy.deepcopy(context.action_space)
        self._official = (
            None if self._has_extended_api else OfficialActions(self.spec, context.control)
        )
        space = (
            official_space(context.observation_space)
            if self._official
            else context.observation_space
        )
        checked = check_settings(kind, self.spec, merged(source.settings, settings))
        arguments = (self._action_space, space, *([checked] if checked else []))
        self._check_signature(kind, arguments)
        self._controller = self._call_guarded(kind, *arguments)
        if _learns_across_trials(self._controller) != self.identity.learns_across_trials:
            raise fault(self, "learns_across_trials must be set on the class, not on the instance")

    def call(self, hook: str, *arguments: Any) -> Any:
        """Call a hook, if there is one; raises ControllerError."""
        if not (self._has_extended_api or hook in OFFICIAL_HOOKS):
            return None
        bound = getattr(self._controller, hook, None)
        converted = map(self._convert_argument, arguments)
        return self._call_guarded(bound, *converted) if callable(bound) else None

    def seed(self, seed: int) -> None:
        """Seed the controller and the global generators that it may draw from."""
        numpy_seed = seed % 2**32
        np.random.seed(numpy_seed)  # noqa: NPY002  the official controllers use it
        random.seed(seed)
        if "torch" in sys.modules:
            sys.modules["torch"].manual_seed(seed)
        self._action_space.seed(numpy_seed)
        self.call("seed", seed)

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        """The next whole action; it can be executed."""
        action = self._call_guarded(self._controller.next_action, observation)
        try:
            return check_action(action, self._control)
        except ActionError as error:
            raise fault(self, f"next_action() returned a bad action: {error}") from error

    def step(self, observation: Mapping[str, Any]) -> tuple[Command, bool]:
        """The next step's command, and whether images are wanted."""
        action = self._call_guarded(
            self._controller.step, self._convert_argument(observation), 0, False
        )
        try:
            if self._official:
                action = self._official.drop_unknown_keys(action)
            return self._control.command(action), wants_render(action)
        except ActionError as error:
            raise fault(self, f"step() returned a bad action: {error}") from error
        except (Exception, SystemExit) as error:  # a stranger's object may raise anything
            where = blame(error, self._place)
            raise fault(self, f"step() returned a bad action: {where}") from error

    def take_logged(self) -> list[Entry]:
        """The numbers that it logged since the last call."""
        return take_entries(self._controller) if self._has_extended_api else []

    def get_state(self) -> ControllerState:
        """What the controller hands over, its own copy."""
        state = self.call("get_state")
        if state is None:  # a class of its own, without the method
            return {}
        if not isinstance(state, dict):
            raise ControllerError(
                f"controller {self.spec}: get_state() must return a dict, "
                f"not {type(state).__name__}"
            )
        return cast(ControllerState, self._call_guarded(copy.deepcopy, state))

    def set_state(self, state: ControllerState) -> None:
        """Go on from a state; an empty one is none."""
        if not state:
            return
        self.call("set_state", state)

    def explain(self) -> Explanation | None:
        """Why it chose its last action, if it says so."""
        explanation = self.call("explain")
        if explanation is not None and not isinstance(explanation, Explanation):
            raise fault(
                self, f"explain() must return an Explanation, not {type(explanation).__name__}"
            )
        return explanation

    def get_files(self) -> dict[str, bytes]:
        """None: it writes to the user's own folder, and finds that again by itself."""
        return {}

    def copy(self) -> LocalProxy:
        """An independent copy of the controller as it is now."""
        if name := shared_through(self._controller, self._place):
            raise fault(
                self,
                f"cannot be copied for each goal: {name} holds the controller, so its copies "
                "would share it. Keep it in an instance, or set learns_across_trials = True",
            )
        clone = copy.copy(self)
        try:
            pair = copy.deepcopy((self._controller, self._action_space))
        except Exception as error:
            raise fault(
                self,
                f"cannot be copied for each goal ({blame(error, self._place)}): define "
                "__deepcopy__, or set learns_across_trials = True",
            ) from error
        clone._controller, clone._action_space = pair
        clone._folder = copy.copy(self._folder)
        return clone

    def close(self) -> None:
        """Nothing to release."""

    def _convert_argument(self, argument: Any) -> Any:
        """What the controller is given for an argument: an observation as its kind knows it."""
        if type(argument) is not Observation:
            return argument
        return official_observation(argument) if self._official else argument.now()

    def _call_guarded(self, function: Callable[..., Any], *arguments: Any) -> Any:
        ours = self._folder.enter()
        try:
            return function(*arguments)
        except PhysicsError:
            raise  # of the world that it looks at, not its own
        except (Exception, SystemExit) as error:
            if is_self_explanatory(error, self._place):
                raise fault(self, str(error), ControllerDeclinedError) from error
            name = getattr(function, "__name__", "it")
            hint = missing_key(error, self._observed) if isinstance(error, KeyError) else ""
            wrong = misfit(function, arguments) if isinstance(error, TypeError) else ""
            where = wrong or f"{blame(error, self._place)}{hint}"
            raise fault(self, f"{name}() failed at {where}") from error
        finally:
            self._folder.leave(ours)

    def _check_signature(self, kind: type[Any], arguments: tuple[Any, ...]) -> None:
        """Report a class that takes the action space alone, as in 2019."""
        if not accepts(kind, arguments) and accepts(kind, arguments[:1]):
            raise fault(
                self,
                "its __init__ takes only the action space, as in the competition of 2019: since "
                "2020 it is __init__(self, action_space, observation_space)",
            )


def _learns_across_trials(controller: object) -> bool:
    """What it says; official controllers met all goals in order, so that is their default."""
    default = not isinstance(controller, Controller)
    if isinstance(controller, type):
        default = not uses_extended_api(controller)
    return bool(getattr(controller, "learns_across_trials", default))
