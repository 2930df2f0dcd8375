"""Controllers whose actions follow from how many they have made."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from real_bench.actions import ACTION_STEPS, Action
from real_bench.controller import Controller, ControllerState
from real_bench.recording.state import save_state


def points(number: int) -> np.ndarray[Any, Any]:
    """A push that differs from every other."""
    return np.array([[-0.2 + 0.001 * number, 0.3], [0.0, -0.3 + 0.001 * number]])


class Macros(Controller):
    """The series as whole actions."""

    n_actions = 0

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        self.n_actions += 1
        return Action.macro(points(self.n_actions))

    def get_state(self) -> ControllerState:
        return {"n_actions": self.n_actions}

    def set_state(self, state: ControllerState) -> None:
        self.n_actions = state["n_actions"]


class StepMacros(Controller):
    """The series as one call a step."""

    n_calls = 0

    def step(self, observation: Mapping[str, Any], reward: float, done: bool) -> dict[str, Any]:
        self.n_calls += 1
        return {"macro_action": points(1 + (self.n_calls - 1) // ACTION_STEPS), "render": False}

    def get_state(self) -> ControllerState:
        return {"n_calls": self.n_calls}

    def set_state(self, state: ControllerState) -> None:
        self.n_calls = state["n_calls"]


class ManyKindsOfState(Controller):
    """Every next action depends on all that the state holds."""

    def __init__(self, action_space: Any, observation_space: Any) -> None:
        super().__init__(action_space, observation_space)
        self.weights = np.arange(6, dtype=np.float32).reshape(2, 3)
        self.counter, self.code = np.zeros((), np.int64), b"\0a"
        self.memory: list[Any] = [{"count": 1, "names": ["a"]}, None, float("inf")]

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        self.weights = (self.weights * 1.5 + 1) % 7
        self.counter = self.counter + 1
        self.code = bytes([(byte + 3) % 256 for byte in self.code]) + b"\0"
        self.memory[0]["count"] *= 7
        self.memory[0]["names"].append("ab"[len(self.code) % 2])
        mixture = [
            float(self.weights.sum()) / 50,
            int(self.counter) / 1000,
            sum(self.code) % 97 / 500,
            self.memory[0]["count"] % 101 / 500 + len(self.memory[0]["names"]) / 1000,
        ]
        return Action.macro(np.array([-0.2, -0.4, -0.2, -0.4]) + mixture)

    def get_state(self) -> ControllerState:
        names = ("weights", "counter", "code", "memory")
        return {name: getattr(self, name) for name in names}

    def set_state(self, state: ControllerState) -> None:
        vars(self).update(state)


class Forgetful(Controller):
    """Random macros, and no state handed over."""

    def seed(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        return Action.macro(self.random.uniform([-0.25, -0.5] * 2, [0.05, 0.5] * 2))


class Impatient(Macros):
    """Ctrl-C is pressed twice during its third action, once only for each folder."""

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        action = super().next_action(observation)
        if self.n_actions != 3 or Path("pressed").exists():
            return action
        Path("pressed").touch()
        threading.Thread(target=press_ctrl_c_twice, daemon=True).start()
        return Action.hold(action.commands[0], 10_000_000)  # ends when it is interrupted


def press_ctrl_c_twice() -> None:
    pause = threading.Event()
    for _ in range(2):
        pause.wait(0.3)
        os.kill(os.getpid(), signal.SIGINT)


class InterruptedWhileItIsWritten(Macros):
    """Ctrl-C is pressed twice during the second write of its state, once only for each folder."""

    n_writes = 0

    def get_state(self) -> ControllerState:
        return {"n_actions": self.n_actions, "bait": Bait([self])}

    def write(self) -> None:
        type(self).n_writes += 1
        if self.n_writes == 2 and not Path("pressed").exists():
            Path("pressed").touch()
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)


class Bait(list[Any]):
    """Notices when it is written to a file; holds nothing else."""

    def __iter__(self) -> Iterator[Any]:
        frame: FrameType | None = sys._getframe()
        while frame is not None and frame.f_code is not save_state.__code__:
            frame = frame.f_back
        if frame is not None:
            self[0].write()
        return iter(())

    def __deepcopy__(self, memo: object) -> Bait:
        return self


class SlowToHandOver(Macros):
    """Its state takes long to make; it fails at its sixth action, once only for each folder."""

    def get_state(self) -> ControllerState:
        time.sleep(0.05)
        return super().get_state()

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        if self.n_actions == 5 and not Path("failed").exists():
            Path("failed").touch()
            raise ValueError("no idea")
        return super().next_action(observation)


class FailsAtTheEnd(Macros):
    """Has learned something when ``end_intrinsic_phase`` is over; that fails the first time."""

    learned = False

    def end_intrinsic_phase(
        self, observation: Mapping[str, Any], reward: float, done: bool
    ) -> None:
        if not Path("failed").exists():
            Path("failed").touch()
            raise MemoryError("no room to learn")
        self.learned = True

    def get_state(self) -> ControllerState:
        return {"n_actions": self.n_actions, "learned": self.learned}


class Overtaken(Macros):
    """While it is given its state, another process goes on with the run to 3,000 steps."""

    def set_state(self, state: ControllerState) -> None:
        super().set_state(state)
        if Path("overtake").exists():
            Path("overtake").unlink()
            program = Path(sys.executable).with_name("realbench")
            subprocess.run([program, "intrinsic", "--resume", "--steps", "3000"])


class Heavy(Macros):
    """Its state does not fit where its recording does."""

    def get_state(self) -> ControllerState:
        return {"n_actions": self.n_actions, "weights": np.random.default_rng(0).bytes(300_000)}
