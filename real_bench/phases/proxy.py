"""What the phases need of a controller, wherever it runs: a proxy, and a backend to make it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Protocol

from gymnasium import spaces

from real_bench.actions import Action, Command
from real_bench.controls import Control
from real_bench.errors import ControllerFailedError
from real_bench.explanation import Explanation
from real_bench.logbook import Entry
from real_bench.observation import Observation
from real_bench.recording import ControllerState
from real_bench.task import Task

NO_FILES: Mapping[str, bytes] = MappingProxyType({})


@dataclass(frozen=True)
class Identity:
    """What a controller is, found out without any world.

    Attributes:
        class_name: of its class.
        file: the file that defines it; empty if there is none.
        code_sha256: hash of all code that it could import as its own.
        action_level: whether it decides on whole actions (else: one call a step).
        uses_images: whether it learns from recorded images in every condition.
        learns_across_trials: whether it goes on learning from trial to trial.
        learns_from_experience: whether it learns from a recording (``use_experience``).
        hands_over_state: whether it hands over what it learned (``get_state``).
        takes_state: whether it takes what it handed over (``set_state``).
        settings: in full, as plain values.
        misspelt: names that it defines and that are almost those of hooks, with these.
    """

    class_name: str
    file: str
    code_sha256: str
    action_level: bool
    uses_images: bool
    learns_across_trials: bool
    learns_from_experience: bool
    hands_over_state: bool
    takes_state: bool
    settings: Mapping[str, Any]
    misspelt: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"class {self.class_name} of {self.file or 'no file'}"


class ControllerContext(Protocol):
    """What a controller is made with; a task has them."""

    @property
    def action_space(self) -> spaces.Dict:
        """What may be commanded."""

    @property
    def observation_space(self) -> spaces.Dict:
        """What may be observed."""

    @property
    def control(self) -> Control:
        """What reads its commands."""


class ControllerProxy(Protocol):
    """A controller instance. Every call raises ControllerError if it fails."""

    spec: str
    identity: Identity

    def seed(self, seed: int) -> None:
        """Seed it and the global generators that it may draw from."""

    def call(self, hook: str, *arguments: Any) -> None:
        """Call a hook: with an experience, or an observation, reward and done, or nothing."""

    def next_action(self, observation: Observation) -> Action:
        """The next whole action, one that can be executed."""

    def step(self, observation: Observation) -> tuple[Command, bool]:
        """The next step's command, and whether images are wanted with the next observation."""

    def explain(self) -> Explanation | None:
        """Why it chose its last action, if it says so."""

    def take_logged(self) -> list[Entry]:
        """The numbers that it logged since the last call."""

    def get_state(self) -> ControllerState:
        """What it hands over, a copy of its own."""

    def set_state(self, state: ControllerState) -> None:
        """Go on from a state; an empty one is none."""

    def get_files(self) -> dict[str, bytes]:
        """What it has written into a working directory of its own, by name."""

    def copy(self) -> ControllerProxy:
        """An independent copy of the controller as it is now."""

    def close(self) -> None:
        """It is not needed any more."""


class ControllerBackend(Protocol):
    """Where controllers run."""

    def identity(self, spec: str, settings: Mapping[str, Any] | None) -> Identity:
        """What the controller is; raises ControllerError. None: do not ask for its settings."""

    def proxy(
        self,
        spec: str,
        settings: Mapping[str, Any],
        task: Task,
        files: Mapping[str, bytes] = NO_FILES,
    ) -> ControllerProxy:
        """The controller, made for a task; raises ControllerError.

        Args:
            spec: what the user names it by.
            settings: values for its settings.
            task: what it is made for.
            files: what it has written into its working directory before (see ``get_files``).
        """


@contextmanager
def close_on_error(proxy: ControllerProxy) -> Iterator[ControllerProxy]:
    """Close a proxy if something fails; otherwise it is still needed."""
    try:
        yield proxy
    except BaseException:
        proxy.close()
        raise


def fault(
    proxy: ControllerProxy,
    what: str,
    kind: type[ControllerFailedError] = ControllerFailedError,
) -> ControllerFailedError:
    """An error that names the controller."""
    return kind(f"controller {proxy.spec}: {what}")
