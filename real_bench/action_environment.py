"""The benchmark as a Gymnasium environment of whole actions, with plain boxes for spaces."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from real_bench.actions import Action
from real_bench.environment import OneWorldEnv, RealEnv
from real_bench.errors import RealBenchError
from real_bench.goal_sets import GoalSet
from real_bench.simulation import DEFAULT_SCENE, STEP_S

NUMBERS = ("joint_positions", "touch_sensors")
POSES = ("object_positions", "object_orientations")
ACTION_S = 1000 * STEP_S


class ActionEnv(OneWorldEnv):
    """REAL, one macro-action (1000 steps, 5 s) per call; reinforcement learning libraries can use
    it as it is.

    An action is x1, y1, x2, y2 (metres): push along the table from the first to the second point.
    Observations are a dict of boxes: joints and touch; in O conditions positions and orientations
    of the objects, concatenated; in I conditions the camera image. With goals also
    ``goal_positions`` in O, and the image ``goal`` in I.

    The benchmark has no reward: it is always 0, and ``terminated`` is never true. For training, add
    your own reward in a wrapper. When a trial is truncated, ``info["score"]`` is the goal's score.

    Args:
        condition: OM or IM.
        objects: number of objects, 1 to as many as the scene has.
        scene: ``official``, ``builtin`` or the path to a manifest.
        goals: a goal set or its file, for the extrinsic phase: every ``reset`` begins a trial with
            the next goal, or that of ``options={"goal": k}``.
        max_steps: simulation steps until truncation; by default the phase's length.
        render_mode: ``rgb_array`` (the robot's camera) or ``human`` (pybullet's window).

    Raises:
        RealBenchError: an unknown condition or scene, or goals that do not fit.
    """  # noqa: D205

    metadata = {"render_modes": ["rgb_array", "human"], "render_fps": 1 / ACTION_S}  # noqa: RUF012

    def __init__(
        self,
        condition: str = "OM",
        *,
        objects: int = 1,
        scene: str | Path = DEFAULT_SCENE,
        goals: GoalSet | str | Path | None = None,
        max_steps: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        if condition not in ("OM", "IM"):
            raise RealBenchError(f"whole actions are for OM and IM, not {condition}")
        self._env = RealEnv(
            condition,
            objects=objects,
            scene=scene,
            goals=goals,
            max_steps=max_steps,
            render_mode=render_mode,
        )
        self.render_mode = render_mode
        self._has_goals = goals is not None
        self.action_space = flat_action_space(self._env.action_space)
        self.observation_space = flat_observation_space(
            self._env.observation_space, goals=self._has_goals
        )

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin in a fresh world; ``options={"goal": k}`` picks the k-th goal."""
        super().reset(seed=seed)
        observation, info = self._env.reset(seed=seed, options=options)
        return self._flat(observation), info

    def step(
        self, action: NDArray[np.float64]
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """One macro; raises ActionError for anything but four finite numbers."""
        keys, truncated, info = self._env.execute(Action.macro(action))
        return self._flat(keys), 0.0, False, truncated, info

    def render(self) -> NDArray[np.uint8] | None:
        """The camera's image (240, 320, 3) in mode ``rgb_array``; a window updates itself."""
        return self._env.render()

    def close(self) -> None:
        """Close the simulation."""
        self._env.close()

    def _flat(self, observation: Mapping[str, Any]) -> dict[str, Any]:
        assert isinstance(self.observation_space, spaces.Dict)
        return {key: flattened(observation[key]) for key in self.observation_space}


def flattened(value: Any) -> NDArray[Any]:
    """An observation's value as one array; values per object are joined in their order."""
    if isinstance(value, Mapping):
        return np.concatenate([np.asarray(one) for one in value.values()])
    return np.asarray(value)


def flat_action_space(space: spaces.Space[Any]) -> spaces.Box:
    """The macro's two points as four numbers, metres."""
    assert isinstance(space, spaces.Dict)
    points = space["macro_action"]
    assert isinstance(points, spaces.Box)
    return spaces.Box(points.low.reshape(4), points.high.reshape(4), dtype=np.float64)


def flat_observation_space(space: spaces.Space[Any], *, goals: bool) -> spaces.Dict:
    """Boxes of what is observed, and of the goal if there is one."""
    assert isinstance(space, spaces.Dict)
    sees_objects = POSES[0] in space.spaces
    keys = [*NUMBERS, *(POSES if sees_objects else ("retina",))]
    if goals:
        keys.append("goal_positions" if sees_objects else "goal")
    return spaces.Dict({key: _flat_box(space[key]) for key in keys})


def _flat_box(space: spaces.Space[Any]) -> spaces.Box:
    if not isinstance(space, spaces.Dict):
        assert isinstance(space, spaces.Box)
        return space
    boxes = [one for one in space.values() if isinstance(one, spaces.Box)]
    low, high = (np.concatenate([getattr(box, side) for box in boxes]) for side in ("low", "high"))
    return spaces.Box(low, high, dtype=np.float64)
