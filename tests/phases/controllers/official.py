"""A controller of the official class API that writes down what it meets."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
from real_robots.policy import BasePolicy

LOG = Path("met.jsonl")  # where the process runs


class Witness(BasePolicy):
    def __init__(self, action_space: Any, observation_space: Any) -> None:
        super().__init__(action_space, observation_space)
        self.n_calls = 0
        self.write("__init__", None)

    def step(self, observation: Any, reward: float, done: bool) -> dict[str, Any]:
        self.write("step", observation, reward, done)
        self.n_calls += 1
        return {"joint_command": np.zeros(9), "render": self.n_calls % 3 == 0}

    def start_intrinsic_phase(self) -> None:
        self.write("start_intrinsic_phase", None)

    def end_intrinsic_phase(self, observation: Any, reward: float, done: bool) -> None:
        self.write("end_intrinsic_phase", observation, reward, done)

    def start_extrinsic_phase(self) -> None:
        self.write("start_extrinsic_phase", None)

    def end_extrinsic_phase(self) -> None:
        self.write("end_extrinsic_phase", None)

    def start_extrinsic_trial(self) -> None:
        self.write("start_extrinsic_trial", None)

    def end_extrinsic_trial(self, observation: Any, reward: float, done: bool) -> None:
        self.write("end_extrinsic_trial", observation, reward, done)

    def write(self, hook: str, observation: Any, reward: float = -1, done: Any = None) -> None:
        met = {"hook": hook, "reward": reward, "done": done}
        if observation is not None:
            met |= {
                "keys": sorted(observation),
                "asked": self.n_calls % 3 == 0,
                "listed": type(observation["joint_positions"]) is list,
                "depth": str(observation["depth"].dtype),
                "sees": bool(observation["retina"].any()),
                "goal": hashlib.sha256(observation["goal"].tobytes()).hexdigest(),
                "sees_goal": bool(observation["goal"].any()),
                "positions": positions(observation.get("object_positions")),
                "goal_positions": positions(observation.get("goal_positions")),
                "masks_goal": observation.get("goal_mask") is not None,
            }
        with LOG.open("a") as file:
            file.write(json.dumps(met) + "\n")


def positions(named: dict[str, Any] | None) -> dict[str, list[float]] | None:
    return named and {name: position.tolist() for name, position in named.items()}
