"""Controllers that misbehave, each by one deed; what they would use up is bounded all the same."""

from __future__ import annotations

import atexit
import ctypes
import os
import signal
import socket
import stat
import struct
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

import real_bench.actions
import real_bench.phases.local
import real_bench.scoring.metric
from real_bench.actions import Action
from real_bench.controller import Controller
from real_bench.settings import Settings

MACRO = [[-0.1, 0.3], [-0.1, -0.3]]
FOREVER = 1e6
MIB = 2**20


class Deed(Settings):
    deed: str = "nothing"


class Rogue(Controller):
    """Does its deed at its second action."""

    Settings = Deed
    n_actions = 0

    def __init__(self, action_space: Any, observation_space: Any, settings: Deed) -> None:
        super().__init__(action_space, observation_space)
        self.deed = settings.deed

    def next_action(self, observation: Mapping[str, Any]) -> Any:
        self.n_actions += 1
        if self.n_actions == 2:
            got = getattr(self, self.deed)()
            if got is not None:
                return got
        return Action.macro(MACRO)

    def nothing(self) -> None:
        pass

    # ends

    def segfault(self) -> None:
        ctypes.string_at(0)

    def abort(self) -> None:
        os.abort()

    def exit_at_once(self) -> None:
        os._exit(3)

    def kill_itself(self) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    def stop_itself(self) -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(FOREVER)

    def close_the_channel(self) -> None:
        os.close(channel())
        time.sleep(FOREVER)

    # takes

    def take_memory(self) -> None:
        pieces = [bytearray(64 * MIB) for _ in range(48)]
        raise RuntimeError(f"got {len(pieces)} pieces")

    def take_memory_at_once(self) -> None:
        raise RuntimeError(f"got {np.ones(3 * 2**30, np.uint8).nbytes}")

    def fork_on_and_on(self) -> None:
        for _ in range(20):
            if os.fork() == 0:
                time.sleep(5)
                os._exit(0)
        raise RuntimeError("got 20 processes")

    def start_threads_on_and_on(self) -> None:
        for _ in range(1000):
            threading.Thread(target=time.sleep, args=(5,), daemon=True).start()
        raise RuntimeError("got 1000 threads")

    def print_on_and_on(self) -> None:
        print("\x1b[2J\x1b]0;title\x07" + "first words")
        for _ in range(64):
            os.write(1, b"flood" * (MIB // 10))
            os.write(2, b"flood" * (MIB // 10))
        print("last words")

    # hangs

    def hang(self) -> None:
        time.sleep(FOREVER)

    def hang_in_a_loop(self) -> None:
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGALRM):
            signal.signal(number, signal.SIG_IGN)
        while True:
            pass

    def ask_on_and_on(self) -> None:
        while True:
            speak(message(["sense", "joint_positions"]))
            os.read(channel(), MIB)

    def hang_at_exit(self) -> None:
        atexit.register(time.sleep, FOREVER)
        threading.Thread(target=time.sleep, args=(FOREVER,)).start()

    # lies

    def say_garbage(self) -> None:
        speak(b"\xff" * 1000)

    def announce_much(self) -> None:
        speak(struct.pack("<IQ", 2**32 - 1, 2**64 - 1))
        time.sleep(FOREVER)

    def announce_and_fall_silent(self) -> None:
        speak(struct.pack("<IQ", 1000, 0) + b"abc")
        time.sleep(FOREVER)

    def speak_out_of_turn(self) -> None:
        speak(message(["sense", "goal_poses"]))

    def answer_twice(self) -> None:
        speak(message(["answer", 1]) * 2)

    def blame_with_control_letters(self) -> None:
        raise RuntimeError("\x1b[2J red\nand more\r" + "x" * 100_000)

    # objects

    def a_hostile_array(self) -> object:
        return Hostile()

    def a_liar_about_its_class(self) -> object:
        return Liar()

    def an_action_of_its_own_kind(self) -> object:
        return OwnAction(np.zeros((1, 4)), np.array([10]), np.array([False]))

    def strange_numbers(self) -> object:
        return Action(np.zeros((1, 4)), np.array([Seven(7)]), np.array([False]))

    def broken_numbers(self) -> object:
        action = Action.macro(MACRO)
        object.__setattr__(action, "commands", np.full((1, 4), np.inf))
        return action

    def a_negative_duration(self) -> object:
        action = Action.macro(MACRO)
        object.__setattr__(action, "n_steps", np.array([-5]))
        return action

    def an_overflowing_duration(self) -> object:
        action = Action.macro(MACRO)
        for name, value in (
            ("commands", np.zeros((2, 4))),
            ("n_steps", np.array([2**62, 2**62])),
            ("line", np.zeros(2, bool)),
        ):
            object.__setattr__(action, name, value)
        return action

    def a_huge_shape(self) -> object:
        action = Action.macro(MACRO)
        object.__setattr__(action, "commands", np.broadcast_to(0.0, (2**20, 4)))
        return action

    def objects_in_an_action(self) -> object:
        action = Action.macro(MACRO)
        object.__setattr__(action, "commands", np.array([[Hostile()] * 4], object))
        return action


class Hostile:
    """Does harm when it is looked at."""

    def __array__(self, *arguments: Any, **options: Any) -> Any:
        sys.exit("gotcha")

    def __repr__(self) -> str:
        raise RuntimeError("gotcha")


class Liar:
    """Says that it is an action."""

    @property
    def __class__(self) -> Any:
        return Action

    @__class__.setter
    def __class__(self, value: Any) -> None:
        pass


class OwnAction(Action):
    """Lasts on and on."""

    @property
    def duration(self) -> int:
        return 0

    def first(self, n_steps: int) -> Action:
        return Action.rest(4, 10**8)


class Seven(int):
    """Claims to be less than it is."""

    def __lt__(self, other: Any) -> bool:
        return True

    def __int__(self) -> int:
        return 10**9


class StepRogue(Controller):
    """Returns something strange at its second step."""

    Settings = Deed
    n_steps = 0

    def __init__(self, action_space: Any, observation_space: Any, settings: Deed) -> None:
        super().__init__(action_space, observation_space)
        self.deed = settings.deed

    def step(self, observation: Any, reward: float, done: bool) -> Any:
        self.n_steps += 1
        if self.n_steps == 1:
            return {"macro_action": MACRO}
        return {
            "array": {"macro_action": Hostile()},
            "render": {"macro_action": MACRO, "render": Hostile()},
            "mapping": Trap(),
            "numbers": {"macro_action": [Seven(1), Seven(2), float("nan"), 0]},
        }[self.deed]


class Trap(Mapping[str, Any]):
    """A mapping that raises."""

    def __getitem__(self, key: str) -> Any:
        raise OSError("gotcha")

    def __iter__(self) -> Iterator[str]:
        raise OSError("gotcha")

    def __len__(self) -> int:
        return 1


class StateRogue(Rogue):
    """Hands over something strange."""

    def get_state(self) -> Any:
        return {
            "objects": {"a": Hostile()},
            "dict": TrapState(a=1),
            "keys": {1: 2},
            "deep": nested(5000),
        }[self.deed]


class TrapState(dict[str, Any]):
    def items(self) -> Any:
        raise OSError("gotcha")


def nested(depth: int) -> dict[str, Any]:
    value: dict[str, Any] = {}
    for _ in range(depth):
        value = {"a": value}
    return value


class Patches(Controller):
    """Changes our code, as far as it can reach it, and then plays like anybody else."""

    def __init__(self, action_space: Any, observation_space: Any) -> None:
        super().__init__(action_space, observation_space)

        def perfect(*arguments: Any) -> Any:
            return np.ones(1)

        metric: Any = real_bench.scoring.metric
        metric.object_scores = perfect
        metric.distances = lambda *arguments: np.zeros(1)
        actions: Any = real_bench.actions
        actions.MAX_MAGNITUDE = np.inf
        actions.check_action = lambda action, control: action

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        return Action.macro(MACRO)


def channel() -> int:
    """The descriptor of our end."""
    return next(n for n in range(3, 256) if is_socket(n))


def is_socket(number: int) -> bool:
    try:
        return stat.S_ISSOCK(os.fstat(number).st_mode)
    except OSError:
        return False


def speak(data: bytes) -> None:
    with socket.socket(fileno=os.dup(channel())) as end:
        end.sendall(data)


def message(value: Any) -> bytes:
    from real_bench.sandbox.messages import encode

    return encode(value)
