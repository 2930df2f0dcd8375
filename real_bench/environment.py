"""The benchmark as a Gymnasium environment."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import cycle
from pathlib import Path
from typing import Any, NoReturn

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

from real_bench.actions import Action, check_action, wants_render
from real_bench.conditions import Condition
from real_bench.errors import RealBenchError, SceneError
from real_bench.goal_sets import Goal, GoalSet, as_goal_set
from real_bench.inputs.numeric import short
from real_bench.inputs.whole import whole
from real_bench.lengths import INTRINSIC_STEPS, TRIAL_STEPS
from real_bench.observation import Observation
from real_bench.scoring.metric import goal_score
from real_bench.simulation import DEFAULT_SCENE, STEP_S, load_scene
from real_bench.task import Task
from real_bench.wording import speaks_python


class OneWorldEnv(gymnasium.Env[dict[str, Any], Any]):
    """An environment that cannot be copied, and whose spec can be written as JSON."""

    _spec: EnvSpec | None = None

    def __copy__(self) -> NoReturn:
        raise SceneError("an environment cannot be copied: make another one")

    @property
    def spec(self) -> EnvSpec | None:
        """The spec that gymnasium made it from; paths are text there, since JSON has none."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = plain_spec(spec)


class RealEnv(OneWorldEnv):
    """REAL, one simulation step (5 ms) per call.

    Without goals it is the intrinsic phase: 15,000,000 steps, ``goal`` all zeros. With goals every
    ``reset`` begins a trial of 10,000 steps with the next goal (or ``options={"goal": k}``), in a
    fresh world. The reward is always 0, ``terminated`` is never true; when a trial is truncated,
    ``info["score"]`` is the goal's score.

    Actions are the official dicts; a command may be None (go home). Camera images are zeros
    unless the action's ``render`` is true; the observation of ``reset`` always has them.

    Args:
        condition: two letters, O or I and M, J or C (paper, section Simplifications).
        objects: number of objects, 1 to as many as the scene has (the shipped ones: 3).
        scene: ``official``, ``builtin`` or the path to a manifest.
        goals: a goal set or its file, for the extrinsic phase; with a file, the environment's spec
            can be written as JSON.
        max_steps: steps until truncation; by default the phase's length.
        render_mode: ``rgb_array`` (the robot's camera) or ``human`` (pybullet's window).

    Raises:
        RealBenchError: an unknown condition or scene, or goals that do not fit.
    """

    metadata = {"render_modes": ["rgb_array", "human"], "render_fps": round(1 / STEP_S)}  # noqa: RUF012

    @speaks_python
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
        loaded = load_scene(scene)
        goal_set = None if goals is None else as_goal_set(goals)
        if goal_set is not None:
            goal_set.check_fits(loaded, objects)
        self._goal_set = goal_set
        self._next_goals: Iterator[Goal] = cycle(goal_set.goals if goal_set else ())
        if max_steps is not None:
            max_steps = whole(max_steps, "max_steps", 1)
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise RealBenchError(f"render_mode must be rgb_array or human, not {render_mode!r}")
        self._max_steps = max_steps or (TRIAL_STEPS if goal_set else INTRINSIC_STEPS)
        self.render_mode = render_mode
        self._task = Task(loaded, Condition.parse(condition), objects, gui=render_mode == "human")
        self.action_space = self._task.action_space
        self.observation_space = self._task.observation_space

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin in a fresh world, with the next goal where there are goals.

        Args:
            seed: begins with the first goal again.
            options: ``{"goal": k}`` picks the k-th goal.
        """
        super().reset(seed=seed)
        if seed is not None and self._goal_set is not None:
            self._next_goals = cycle(self._goal_set.goals)
        self._task.begin(self._choose_goal({} if options is None else options))
        return self._task.observe().now(), {}

    def step(
        self, action: Mapping[str, Any]
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """One simulation step; raises ActionError for an invalid action."""
        self._task.step(self._task.control.command(action))
        observation = self._task.observe(render=wants_render(action)).now()
        truncated = self._task.n_steps >= self._max_steps
        return observation, 0.0, False, truncated, self._info(truncated)

    def execute(self, action: Action) -> tuple[Observation, bool, dict[str, Any]]:
        """A whole action, or as much of it as there are steps left, in the fast loop.

        Returns:
            The observation afterwards (images are rendered when read), whether that was the last
            step, and the info of :meth:`step`.

        Raises:
            ActionError: it does not fit the condition.
        """
        left = max(self._max_steps - self._task.n_steps, 1)
        self._task.execute(check_action(action, self._task.control).first(left))
        truncated = self._task.n_steps >= self._max_steps
        return self._task.observe(), truncated, self._info(truncated)

    def render(self) -> NDArray[np.uint8] | None:
        """The camera's image (240, 320, 3) in mode ``rgb_array``; a window updates itself."""
        return self._task.simulation.image().retina if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Close the simulation."""
        self._task.close()

    def _choose_goal(self, options: Mapping[str, Any]) -> Goal | None:
        if not isinstance(options, Mapping) or set(options) - {"goal"}:
            raise RealBenchError(f'options of reset() may be {{"goal": k}}, not {short(options)}')
        if self._goal_set is None:
            if "goal" in options:
                raise RealBenchError("there is no goal to choose from: give the environment goals")
            return None
        if "goal" in options:
            return self._goal_set.goals[whole(options["goal"], "goal", 0, len(self._goal_set) - 1)]
        return next(self._next_goals)

    def _info(self, truncated: bool) -> dict[str, Any]:
        if not truncated or self._task.goal is None:
            return {}
        positions = self._task.simulation.object_poses()[:, :3]
        return {"score": goal_score(positions, self._task.goal.final_poses[:, :3])}


def plain_spec(spec: EnvSpec | None) -> EnvSpec | None:
    """An environment's spec with paths as text, since JSON has none."""
    if spec is not None:
        spec.kwargs = {
            name: str(value) if isinstance(value, Path) else value
            for name, value in spec.kwargs.items()
        }
    return spec
