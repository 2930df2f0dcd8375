"""A part of a recording, replayed exactly: from the start of its world, but only it is shown."""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from real_bench.conditions import Condition
from real_bench.errors import ActionError, Interrupted, PhysicsError, RecordingError
from real_bench.phases.stopping import stop_requests
from real_bench.recording import Recording
from real_bench.replay.actions import ActionReplayer, fresh_states
from real_bench.simulation.scene import Scene, load_scene
from real_bench.task import Task

OnAction = Callable[[int, int], None]

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Frame:
    """The present moment of a replay.

    Attributes:
        task: the world.
        number: of the action.
        step: of the recording.
        as_recorded: whether everything so far came out as recorded.
    """

    task: Task
    number: int
    step: int
    as_recorded: bool


Show = Callable[[Frame], None]


@dataclass(frozen=True)
class PartReplay:
    """Some actions of a recording to replay.

    Attributes:
        path: the recording.
        first, last: numbers of the first action and of the one after the last.
        scene: a name or manifest; None: the one that the recording names.
    """

    path: Path
    first: int
    last: int
    scene: str | None = None

    def run(self, show: Show, every: int, report: OnAction, *, gui: bool = False) -> bool:
        """Replay everything since the world of the first action began; show the part.

        Args:
            show: called where the part begins, and then after every ``every`` steps of it.
            every: steps between calls.
            report: called with the actions replayed and their total.
            gui: use pybullet's window.

        Returns:
            Whether every action of the part ended as recorded, to the last bit.

        Raises:
            RecordingError: it cannot be read or replayed, or has no such actions.
            SceneError: its scene is not available, or there is no display.
            Interrupted: the user stopped it.
        """
        with Recording(self.path) as recording:
            if not 0 <= self.first < self.last <= len(recording):
                raise RecordingError(
                    f"{self.path} has actions 0 to {len(recording) - 1}, "
                    f"not {self.first} to {self.last - 1}"
                )
            header = recording.header
            condition = Condition.parse(header.condition)
            if mismatch := condition.control_mismatch(header.control_version):
                raise RecordingError(f"{self.path} cannot be replayed: {mismatch}")
            scene = self._scene(recording)
            with closing(Task(scene, condition, header.objects, gui=gui)) as task:
                return _Part(self, recording, task).run(show, every, report)

    def _scene(self, recording: Recording) -> Scene:
        header = recording.header
        scene = load_scene(header.scene_source if self.scene is None else self.scene)
        if scene.sha256 != header.scene_sha256:
            raise RecordingError(
                f"{self.path} was made in scene {header.scene} {header.scene_sha256[:12]}, "
                f"not in this {scene.name} {scene.sha256[:12]}"
            )
        return scene


class _Part:
    """The replay itself."""

    def __init__(self, part: PartReplay, recording: Recording, task: Task) -> None:
        self._part, self._recording, self._task = part, recording, task
        self._rows, self._poses = recording.transitions, recording.object_poses
        self._fresh = set(fresh_states(recording).tolist())
        self._replayer = ActionReplayer(recording, task)
        self._number, self._world_began_at, self._as_recorded = part.first, 0, True

    def run(self, show: Show, every: int, report: OnAction) -> bool:
        first, last = self._part.first, self._part.last
        start = self._first_action_of_world(first)
        with stop_requests() as stop:
            for number in range(start, last):
                if stop.requested:
                    raise Interrupted(f"stopped after {number - start} of {last - start} actions")
                report(number - start, last - start)
                self._begin(number)
                if number == first:
                    self._task.watch(lambda: show(self._now()), every)
                    show(self._now())
                self._act(number)
            report(last - start, last - start)
        return self._as_recorded

    def _first_action_of_world(self, number: int) -> int:
        """The first action of the world in which this one was done."""
        while int(self._rows["precondition"][number]) not in self._fresh:
            number -= 1
        return number

    def _begin(self, number: int) -> None:
        """Go to the start of an action, which may be in a fresh world."""
        self._number = number
        state = int(self._rows["precondition"][number])
        if state in self._fresh:
            self._replayer.begin(state)
            self._world_began_at = int(self._rows["first_step"][number])

    def _act(self, number: int) -> None:
        try:
            self._replayer.act(number)
        except (ActionError, PhysicsError) as error:
            raise RecordingError(
                f"action {number:,} of {self._part.path} cannot be replayed: {error}"
            ) from error
        poses = self._task.simulation.object_poses()
        if self._as_recorded and not np.array_equal(
            poses, self._poses[self._rows["outcome"][number]]
        ):
            self._as_recorded = False
            log.warning(
                "since action %d objects are not where they were recorded: this machine's physics "
                "may differ (realbench verify %s says more)",
                number,
                self._part.path,
            )

    def _now(self) -> Frame:
        step = self._world_began_at + self._task.n_steps
        return Frame(self._task, self._number, step, self._as_recorded)
