"""Replay the trials of a result."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from real_bench.actions import check_action
from real_bench.conditions import Condition
from real_bench.errors import ActionError, PhysicsError
from real_bench.goal_sets import Goal, GoalSet
from real_bench.phases.trial import trial_result
from real_bench.scoring.commands import Commands
from real_bench.scoring.result import TrialResult
from real_bench.simulation.scene import Scene
from real_bench.task import Task
from real_bench.verification.differences import (
    ROUNDING,
    TOLERANCE_M,
    Difference,
    attribute_to_physics,
    numbers_differ,
    poses_differ,
)
from real_bench.verification.verdicts import TrialCheck

PLACEMENT_TOLERANCE_M = 1e-9
"""How far an object may be put from its start because of rounding, metres."""


class TrialReplayer:
    """Runs the trials of a result again, from their commands.

    Args:
        scene, condition: of the result.
        goal_set: its goals.
        trial_steps: how long its trials last.
        other_physics: whether it was made with different physics.
    """

    def __init__(
        self,
        scene: Scene,
        condition: Condition,
        goal_set: GoalSet,
        trial_steps: int,
        other_physics: bool = False,
    ) -> None:
        self._task = Task(scene, condition, goal_set.n_objects)
        self._goals = goal_set.goals
        self._trial_steps = trial_steps
        self._other_physics = other_physics

    def check(self, trial: TrialResult) -> TrialCheck:
        """Replay a trial that keeps its commands; returns what differs."""
        assert trial.commands is not None  # results without commands were refused before
        goal = self._goals[trial.goal]
        try:
            found = list(self._differences(trial, trial.commands, goal))
        except (ActionError, PhysicsError) as error:
            by_physics = self._other_physics and isinstance(error, PhysicsError)
            reason = f"its commands cannot be replayed: {error}"
            found = [Difference(reason, of_physics=by_physics)]
        found += _contradictions(trial, trial.commands, goal)
        return TrialCheck(trial.goal, trial.challenge, tuple(found))

    def close(self) -> None:
        """Let go of the simulation."""
        self._task.close()

    def _differences(
        self, trial: TrialResult, commands: Commands, goal: Goal
    ) -> Iterator[Difference]:
        task, simulation = self._task, self._task.simulation
        actions = [check_action(action, task.control) for action in commands.actions]
        task.begin(goal)
        placed = simulation.object_poses()[:, :3]
        away = np.linalg.norm(placed - goal.initial_poses[:, :3], axis=1).max()
        if away > PLACEMENT_TOLERANCE_M:
            yield Difference("where it begins", float(away), "m")
        for action in actions:
            task.execute(action)
        if task.n_steps != self._trial_steps:
            yield Difference("its length", abs(task.n_steps - self._trial_steps), "steps")
        recorded, names = np.array(trial.final_poses), simulation.object_names
        replayed = simulation.object_poses()
        if self._other_physics:
            differences = poses_differ(recorded, replayed, names, within=TOLERANCE_M)
            yield from attribute_to_physics(differences)
        else:
            yield from poses_differ(recorded, replayed, names)


def _contradictions(trial: TrialResult, commands: Commands, goal: Goal) -> Iterator[Difference]:
    """What contradicts the poses, the goal or the commands, in any physics."""
    derived = trial_result(trial.goal, goal, np.array(trial.final_poses), commands)
    if trial.challenge != derived.challenge:
        yield Difference(f"its class is {derived.challenge}, not {trial.challenge}")
    yield from numbers_differ("distance", trial.distances, derived.distances, "m", within=ROUNDING)
    if trial.actions_sha256 != derived.actions_sha256:
        yield Difference("actions_sha256 does not match its commands")
