"""Replays the trials of a result."""

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
from real_bench.verification.differences import Difference, numbers_differ, poses_differ
from real_bench.verification.verdicts import TrialCheck

PLACED_WITHIN_M = 1e-9
"""How far from its start, by rounding, an object may be put."""


class TrialReplayer:
    """Makes the trials of a result once more, from their commands.

    Args:
        scene, condition: of the result.
        goal_set: its goals.
        trial_steps: how long its trials last.
    """

    def __init__(
        self, scene: Scene, condition: Condition, goal_set: GoalSet, trial_steps: int
    ) -> None:
        self._task = Task(scene, condition, goal_set.n_objects)
        self._goals = goal_set.goals
        self._trial_steps = trial_steps

    def check(self, trial: TrialResult) -> TrialCheck:
        """Replay one trial, which keeps its commands; what differs is in what comes back."""
        assert trial.commands is not None  # results without commands are refused before
        try:
            found = tuple(self._differences(trial, trial.commands, self._goals[trial.goal]))
        except (ActionError, PhysicsError) as error:
            found = (Difference(f"its commands cannot be replayed: {error}"),)
        return TrialCheck(trial.goal, trial.challenge, found)

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
        if away > PLACED_WITHIN_M:
            yield Difference("where it begins", float(away), "m")
        for action in actions:
            task.execute(action)
        if task.n_steps != self._trial_steps:
            yield Difference("its length", abs(task.n_steps - self._trial_steps), "steps")
        replayed = trial_result(trial.goal, goal, simulation.object_poses(), commands)
        yield from _results_differ(trial, replayed, simulation.object_names)


def _results_differ(
    recorded: TrialResult, replayed: TrialResult, names: tuple[str, ...]
) -> Iterator[Difference]:
    if recorded.challenge != replayed.challenge:
        yield Difference(f"its class is {replayed.challenge}, not {recorded.challenge}")
    yield from poses_differ(np.array(recorded.final_poses), np.array(replayed.final_poses), names)
    yield from numbers_differ("distance", recorded.distances, replayed.distances, "m")
    if recorded.actions_sha256 != replayed.actions_sha256:
        yield Difference("actions_sha256 is not that of its commands")
