"""The child: imports the controller and answers requests until the channel is closed."""

from __future__ import annotations

import socket
import sys
import traceback
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces

from real_bench.actions import Action
from real_bench.conditions import Condition
from real_bench.controller_code.blame import blame
from real_bench.controller_code.finding import find_controller
from real_bench.controller_code.source import ControllerSource
from real_bench.controls import Control
from real_bench.errors import RealBenchError
from real_bench.observation import Observation
from real_bench.phases.local import LocalProxy, identify
from real_bench.recording import Experience
from real_bench.recording.state import restore_state, strip_state
from real_bench.sandbox.channel import Channel, ChannelClosed, SpinWait
from real_bench.sandbox.faults import fault_kind
from real_bench.sandbox.messages import Size
from real_bench.sandbox.observation_packing import Unpacker
from real_bench.sandbox.working_directory import new_files, put_files
from real_bench.simulation.manifest import Manifest
from real_bench.simulation.scene import Scene
from real_bench.spaces import action_space, observation_space

ANYTHING = Size(structure=1 << 28, numbers=1 << 36)  # the parent is trusted


@dataclass(frozen=True)
class _Context:
    action_space: spaces.Dict
    observation_space: spaces.Dict
    control: Control


class RpcServer:
    """Does what the parent asks with the controller and its copies."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._spec = ""
        self._proxies: dict[int, LocalProxy] = {}
        self._n_made = 0

    def serve(self) -> None:
        """Answer questions until there are no more."""
        while True:
            question, *arguments = self._channel.receive(ANYTHING)
            try:
                answer = ["answer", getattr(self, f"do_{question}")(*arguments)]
                self._channel.send(answer)
            except RealBenchError as error:
                self._fail(str(error), error)
            except ChannelClosed:
                raise
            except Exception as error:  # hostile objects may raise anything, anywhere
                self._fail(f"controller {self._spec}: {question} failed at {blame(error)}", error)

    def _fail(self, text: str, error: BaseException) -> None:
        trace = "".join(traceback.format_exception(error))
        self._channel.send(["fault", fault_kind(error), text[:10_000], trace[-5_000:]])

    def do_identity(
        self, spec: str, place: str, settings: Mapping[str, Any] | None
    ) -> dict[str, Any]:
        """Import the controller at ``place``, and describe it."""
        self._spec = spec
        source = replace(ControllerSource.of(place), spec=spec, is_hashed=False)
        kind = find_controller(place)
        self._kind, self._source, self._settings = kind, source, settings or {}
        identity = identify(kind, source, settings)
        return {
            "class_name": identity.class_name,
            "file": identity.file,
            "action_level": identity.action_level,
            "uses_images": identity.uses_images,
            "learns_across_trials": identity.learns_across_trials,
            "learns_from_experience": identity.learns_from_experience,
            "hands_over_state": identity.hands_over_state,
            "takes_state": identity.takes_state,
            "settings": dict(identity.settings),
            "misspelt": list(identity.misspelt),
        }

    def do_put_files(self, names: list[str], contents: list[Any]) -> None:
        """Write files into the working directory."""
        put_files(dict(zip(names, (content.tobytes() for content in contents), strict=True)))

    def do_get_files(self) -> list[list[Any]]:
        """What was written into the working directory since it began."""
        files = new_files()
        contents = [np.frombuffer(content, np.uint8) for content in files.values()]
        return [list(files), contents]

    def do_make(self, manifest: dict[str, Any], condition: str, n_objects: int) -> None:
        """Make the controller."""
        parsed = Condition.parse(condition)
        scene = Scene(Manifest.model_validate(manifest), Path(), "")
        context = _Context(
            action_space(scene, parsed),
            observation_space(scene, parsed, n_objects),
            parsed.control_type(),
        )
        self._unpacker = Unpacker(context.observation_space)
        self._proxies[0] = LocalProxy(self._source, self._kind, self._settings, context)

    def do_copy(self, number: int) -> int:
        """Make a copy; returns its number."""
        self._n_made += 1
        self._proxies[self._n_made] = self._proxies[number].copy()
        return self._n_made

    def do_forget(self, number: int) -> None:
        """Let go of a copy."""
        del self._proxies[number]

    def do_seed(self, number: int, seed: int) -> None:
        """Seed it."""
        self._proxies[number].seed(seed)

    def do_call(self, number: int, hook: str, arguments: list[Any]) -> None:
        """Call a hook."""
        self._proxies[number].call(hook, *map(self._decode_argument, arguments))

    def do_next_action(self, number: int, keys: list[str]) -> list[Any]:
        """The next action; observations are fetched as the controller reads them."""
        observation = Observation({key: partial(self._sense, key) for key in keys})
        try:
            return _parts(self._proxies[number].next_action(observation))
        finally:
            observation.expire()

    def do_step(self, number: int, message: dict[str, Any]) -> list[Any]:
        """The next step's command, and whether images are wanted."""
        return list(self._proxies[number].step(self._unpacker.unpack(message)))

    def do_explain(self, number: int) -> list[Any] | None:
        """Why it chose its last action."""
        explanation = self._proxies[number].explain()
        if explanation is None:
            return None
        facts = list(strip_state(dict(explanation.facts)))
        return [
            str(explanation.title),
            facts,
            [_parts(one) for one in explanation.actions],
            explanation.positions,
        ]

    def do_take_logged(self, number: int) -> list[list[Any]]:
        """The numbers that it logged since the last call."""
        return [[name, value] for name, value in self._proxies[number].take_logged()]

    def do_get_state(self, number: int) -> list[Any]:
        """What it hands over."""
        return list(strip_state(self._proxies[number].get_state()))

    def do_set_state(self, number: int, structure: str, arrays: list[Any]) -> None:
        """Go on from a state."""
        state = restore_state(structure, lambda index: arrays[index])
        self._proxies[number].set_state(state)

    def _sense(self, key: str) -> Any:
        self._channel.send(["sense", key])
        return self._channel.receive(ANYTHING)

    def _decode_argument(self, argument: Any) -> Any:
        match argument:
            case {"path": path, "condition": condition, "n_steps": n_steps}:
                return Experience(Path(path), Condition.parse(condition), n_steps)
            case {"observed": message}:
                return self._unpacker.unpack(message)
            case _:
                return argument


def _parts(action: Action) -> list[Any]:
    return [action.commands, action.n_steps, action.line]


def serve(descriptor: int) -> None:
    """Serve on an inherited socket until the parent is done."""
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    channel = Channel(socket.socket(fileno=descriptor), SpinWait())
    with suppress(ChannelClosed):
        RpcServer(channel).serve()
