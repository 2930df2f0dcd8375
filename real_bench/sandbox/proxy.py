"""A controller in a process of its own, as the phases see it: a proxy like any other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action, Command, check_action, check_command
from real_bench.controls import Control
from real_bench.errors import ActionError, BrokenRuleError
from real_bench.explanation import Explanation
from real_bench.logbook import MAX_ENTRIES, MAX_ENTRIES_OF_STRANGERS, Entry, checked_entry
from real_bench.observation import Observation
from real_bench.phases.proxy import Identity, fault
from real_bench.recording import ControllerState, Experience
from real_bench.recording.excerpt import write_excerpt
from real_bench.recording.state import restore_state, strip_state
from real_bench.sandbox.observation_packing import pack_observation
from real_bench.sandbox.rpc_client import EXPLANATION, LOGGED, STATE, RpcClient
from real_bench.sandbox.working_directory import is_plain_path

Arrays = list[NDArray[Any]]


class SandboxProxy:
    """A controller behind a channel. What comes back is plain data, and checked again here.

    Args:
        spec: how the user names it, for messages.
        identity: what it is.
        control: what its commands must fit.
        client: of its process.
        number: which copy in that process it is; 0 is the original.
    """

    def __init__(
        self,
        spec: str,
        identity: Identity,
        control: Control,
        client: RpcClient,
        number: int = 0,
    ) -> None:
        self.spec, self.identity = spec, identity
        self.client = client
        self._control, self._number = control, number
        self._n_logged = 0

    def seed(self, seed: int) -> None:
        """Seed it and the global generators that it may draw from."""
        self._ask("seed", seed)

    def call(self, hook: str, *arguments: Any) -> None:
        """Call a hook: with an experience, or an observation, reward and done, or nothing."""
        self._ask("call", hook, [self._encode_argument(argument) for argument in arguments])

    def next_action(self, observation: Observation) -> Action:
        """The next whole action, one that can be executed; observations are sent on demand."""
        answer = self._ask("next_action", list(observation), observation=observation)
        try:
            return check_action(_action(answer), self._control)
        except ActionError as error:
            raise fault(self, f"next_action() returned a bad action: {error}") from error

    def step(self, observation: Observation) -> tuple[Command, bool]:
        """The next step's command, and whether images are wanted."""
        message = pack_observation(observation, self.client.known_world)
        self.client.known_world = observation.world
        match self._ask("step", message):
            case [np.ndarray() as command, bool(render)]:
                pass
            case _:
                raise broken(self, "step() returned a bad action: it is not a command")
        try:
            return check_command(command, self._control), render
        except ActionError as error:
            raise fault(self, f"step() returned a bad action: {error}") from error

    def explain(self) -> Explanation | None:
        """Why it chose its last action, if it says so."""
        match self._ask("explain", size=EXPLANATION):
            case None:
                return None
            case [str(title), facts, list(actions), positions]:
                pass
            case _:
                raise fault(self, "explain() returned a bad explanation")
        try:
            if not (positions is None or isinstance(positions, np.ndarray)):
                raise ActionError("positions must be an array")
            made = tuple(map(_action, actions))
            return Explanation(title[:200], self._restored(facts), made, positions)
        except ActionError as error:
            raise fault(self, f"explain() returned a bad explanation: {error}") from error

    def take_logged(self) -> list[Entry]:
        """The numbers that it logged since the last call."""
        answer = self._ask("take_logged", size=LOGGED)
        if not (isinstance(answer, list) and len(answer) <= MAX_ENTRIES):
            raise fault(self, "its process did not say what was logged")
        self._n_logged += len(answer)
        if self._n_logged > MAX_ENTRIES_OF_STRANGERS:
            raise fault(self, f"it logged more than {MAX_ENTRIES_OF_STRANGERS:,} numbers")
        return [self._entry(one) for one in answer]

    def get_state(self) -> ControllerState:
        """What it hands over."""
        return self._restored(self._ask("get_state", size=STATE))

    def set_state(self, state: ControllerState) -> None:
        """Go on from a state; an empty one is none."""
        self._ask("set_state", *strip_state(state))

    def get_files(self) -> dict[str, bytes]:
        """What it has written into its working directory, by name."""
        match self.client.ask("get_files", size=STATE):
            case [list(names), list(contents)] if len(names) == len(contents):
                pass
            case _:
                raise broken(self, "its process did not say what files it wrote")
        if not all(isinstance(name, str) and is_plain_path(name) for name in names):
            raise broken(self, "its process gives a file a name outside its folder")
        if not all(isinstance(one, np.ndarray) and one.dtype == np.uint8 for one in contents):
            raise broken(self, "its process gives files that do not hold bytes")
        return dict(zip(names, (content.tobytes() for content in contents), strict=True))

    def copy(self) -> SandboxProxy:
        """An independent copy of the controller as it is now, in the same process."""
        number = self._ask("copy")
        if type(number) is not int:
            raise broken(self, "its process did not say which copy it made")
        return SandboxProxy(self.spec, self.identity, self._control, self.client, number)

    def close(self) -> None:
        """Drop a copy; closing the original ends the process."""
        if self._number == 0:
            self.client.close()
        elif not self.client.is_over:
            self._ask("forget")

    def _ask(self, question: str, *arguments: Any, **options: Any) -> Any:
        return self.client.ask(question, self._number, *arguments, **options)

    def _encode_argument(self, argument: Any) -> Any:
        if isinstance(argument, Experience):
            path = self.client.new_file()
            write_excerpt(argument, path)
            return {
                "path": str(path),
                "condition": argument.condition.name,
                "n_steps": argument.n_steps,
            }
        return (
            {"observed": pack_observation(argument, -1)}
            if type(argument) is Observation
            else argument
        )

    def _entry(self, entry_data: object) -> Entry:
        match entry_data:
            case [str(name), float(value)]:
                pass
            case _:
                raise fault(self, "it logged something other than a name and a number")
        try:
            return checked_entry(name, value)
        except ValueError as error:
            raise fault(self, f"it logged something that cannot be recorded: {error}") from error

    def _restored(self, answer: Any) -> ControllerState:
        match answer:
            case [str(structure), list(arrays)]:
                pass
            case _:
                raise broken(self, "its process did not hand over a state")
        try:
            if not all(isinstance(array, np.ndarray) for array in arrays):
                raise ValueError("an array is missing")
            return restore_state(structure, lambda number: arrays[number])
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
            raise broken(self, f"its process hands over a damaged state: {error}") from error


def broken(proxy: SandboxProxy, what: str) -> BrokenRuleError:
    """An error of a controller that tampered with its process: no honest one answers so."""
    return BrokenRuleError(f"controller {proxy.spec}: {what}")


def put_files(client: RpcClient, files: Mapping[str, bytes]) -> None:
    """Put files into the working directory, before the controller is imported."""
    if files:
        contents = [np.frombuffer(content, np.uint8) for content in files.values()]
        client.ask("put_files", list(files), contents)


def _action(answer: Any) -> Action:
    match answer:
        case [np.ndarray() as commands, np.ndarray() as n_steps, np.ndarray() as line]:
            return Action(commands, n_steps, line)
        case _:
            raise ActionError("an action was expected")
