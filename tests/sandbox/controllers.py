"""Controllers whose every action follows from all that they see."""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import sha256
from typing import Any

import numpy as np

from real_bench.actions import Action
from real_bench.controller import BasePolicy, Controller, Experience


def digest(value: Any) -> str:
    """A hash of a value of an observation, and of its kind."""
    if isinstance(value, dict):
        return "".join(f"{key}: {digest(item)}" for key, item in value.items())
    if not isinstance(value, np.ndarray):
        return f"{type(value).__name__} {value}"
    return sha256(value.tobytes()).hexdigest() + str(value.dtype) + str(value.shape)


def numbers(text: str, size: int) -> np.ndarray[Any, Any]:
    """Numbers from -1 to 1 that follow from a text."""
    seed = int(sha256(text.encode()).hexdigest()[:16], 16)
    return np.random.default_rng(seed).uniform(-1, 1, size)


class Looking:
    """At everything, at every step; spoils what it saw, which must do no harm."""

    n_steps, last = 0, ""

    def step(self, observation: Any, reward: float, done: bool) -> dict[str, Any]:
        assert type(observation) is dict
        seen = "".join(f"{key}: {digest(value)}" for key, value in observation.items())
        assert type(reward) is int
        observation["goal"][:] = 7
        observation["joint_positions"][0] += 1
        self.n_steps += 1
        self.last = sha256((self.last + seen).encode()).hexdigest()
        return {"joint_command": numbers(self.last, 9), "render": self.n_steps % 40 == 0}

    def end_intrinsic_phase(self, observation: Any, reward: float, done: bool) -> None:
        self.last += "".join(f"{key}: {digest(value)}" for key, value in observation.items())

    def end_extrinsic_trial(self, observation: Any, reward: float, done: bool) -> None:
        self.end_intrinsic_phase(observation, reward, done)

    def get_state(self) -> dict[str, Any]:
        return {"last": self.last}


class Looks(Looking, Controller):
    """At observations of ours."""


class LooksOfficially(Looking, BasePolicy):
    """At observations as in the official package, goal after goal."""


class Glances(Controller):
    """At some things, other ones each time."""

    n_actions = 0

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        keys = list(observation)
        self.n_actions += 1
        seen = [digest(observation[key]) for key in keys[self.n_actions % 3 :: 3]]
        assert digest(observation[keys[0]]) == digest(observation[keys[0]])
        return Action.macro(numbers("".join([*keys, *seen]), 4) * [0.2, 0.4, 0.2, 0.4])


class Remembers(Controller):
    """All that its experience tells."""

    def use_experience(self, experience: Experience) -> None:
        parts: list[Any] = [experience.joint_positions, experience.durations, experience.outcomes]
        if experience.sees_objects:
            parts += [experience.positions_before(), experience.positions_after()]
        else:
            parts += [experience.image_after(0), experience.map_images(lambda image: image.sum())]
        parts += [experience.action(i).commands for i in range(len(experience))]
        self.memory = str(experience.object_names) + "".join(map(digest, parts))

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        return Action.macro(numbers(self.memory, 4) * [0.2, 0.4, 0.2, 0.4])
