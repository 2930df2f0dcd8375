"""Replay a recording, world by world and action by action."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action, check_action
from real_bench.errors import ActionError
from real_bench.recording import Recording
from real_bench.task import Task


def fresh_states(recording: Recording) -> NDArray[np.int64]:
    """The numbers of the states in which a world began: the first, and one after each cut."""
    begun = np.ones(recording.n_states, bool)
    begun[recording.transitions["outcome"]] = False
    return np.flatnonzero(begun)


class ActionReplayer:
    """Replays a recording in a task; exact if every action since the world began is replayed.

    Args:
        recording: what to replay.
        task: of its scene, condition and objects.
    """

    def __init__(self, recording: Recording, task: Task) -> None:
        self._recording, self._task = recording, task
        self._joints, self._poses = recording.states["joint_positions"], recording.object_poses

    def begin(self, state: int) -> None:
        """A fresh world: the scene's own, or after a cut as the state before was recorded."""
        self._task.begin(
            object_poses=self._poses[state - 1] if state else None,
            joint_positions=self._joints[state - 1] if state else None,
        )

    def act(self, number: int) -> Action:
        """Execute an action by its number; returns it.

        Raises:
            ActionError: the recorded action is invalid.
            PhysicsError: the world exploded.
        """
        row = self._recording.transitions[number]
        commands = self._recording.commands(int(row["first_command"]), int(row["n_commands"]))
        if commands["line"].max() > 1:
            raise ActionError("a line flag is neither 0 nor 1")
        action = Action.from_rows(commands)
        check_action(action, self._task.control)
        if action.duration != row["n_steps"]:
            raise ActionError(f"the commands last {action.duration} steps, not {row['n_steps']}")
        self._task.execute(action)
        return action
