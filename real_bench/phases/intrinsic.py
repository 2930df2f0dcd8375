"""The intrinsic phase: free play, recorded (paper, section Scenario)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.conditions import Condition
from real_bench.errors import (
    ControllerError,
    Interrupted,
    PhysicsError,
    RealBenchError,
    RecordingError,
)
from real_bench.files import check_output
from real_bench.finding import find_controller, source_sha256
from real_bench.phases.player import Guest
from real_bench.phases.seeds import derived_seed
from real_bench.phases.stopping import StopRequest, stop_requests
from real_bench.recording import MOVED_M, Header, Recorder, Recording, package_versions
from real_bench.simulation.scene import Scene
from real_bench.task import Task

RESUMED_ALIKE = (
    "condition",
    "objects",
    "scene",
    "scene_sha256",
    "seed",
    "controller",
    "images",
)


@dataclass(frozen=True)
class Progress:
    """How far a phase has come.

    Attributes:
        n_steps: simulation steps so far, of ``total_steps``.
        n_actions: actions in this process, of which ``n_moved`` displaced an object by > 1 cm.
    """

    n_steps: int
    total_steps: int
    n_actions: int
    n_moved: int


Report = Callable[[Progress], None]


@dataclass(frozen=True)
class IntrinsicPhase:
    """An intrinsic phase to be run.

    Attributes:
        controller: name, ``module:Class`` or file.
        condition: two letters, as in the paper.
        objects: number of objects.
        scene: name or manifest.
        steps: how long the phase lasts, from its very beginning.
        seed: of the controller's randomness.
        out: the recording.
        images: record the camera image of every state; None: in image conditions only.
    """

    controller: str
    condition: Condition
    objects: int
    scene: Scene
    steps: int
    seed: int
    out: Path
    images: bool | None = None

    def __post_init__(self) -> None:
        if self.steps < 1:
            raise RealBenchError(f"--steps must be at least 1, not {self.steps}")
        if self.seed < 0:
            raise RealBenchError(f"--seed must not be negative, it is {self.seed}")
        if self.images is False and not self.condition.sees_objects:
            raise RealBenchError(f"condition {self.condition.name} is about images: record them")
        self.scene.object_names(self.objects)

    def run(self, report: Report, *, resume: bool = False, overwrite: bool = False) -> Guest:
        """Play to the end; returns the controller as it then is.

        Args:
            report: told of progress after every action.
            resume: go on with the recording where there is one.
            overwrite: replace the recording where there is one.

        Raises:
            Interrupted: the user stopped it; ``resume`` goes on.
            ControllerError: the controller failed; what was recorded before is kept.
            RealBenchError: anything else that is wrong, before or while it runs.
        """
        resume = resume and self.out.exists()
        check_output(self.out, overwrite=overwrite or resume, remedy="--resume or --overwrite")
        kind = find_controller(self.controller)
        header = self._header(kind)
        if resume:
            self._check_resumable(header)
        task = Task(self.scene, self.condition, self.objects)
        try:
            guest = Guest(self.controller, kind, task)
            self._begin(task, guest, resume)
            if not (resume and self._is_complete()):
                with self._recorder(header, task, resume) as recorder, stop_requests() as stop:
                    self._play(task, guest, recorder, report, stop)
        finally:
            task.close()
        return guest

    def _begin(self, task: Task, guest: Guest, resume: bool) -> None:
        """Put world and controller where the phase begins, or where it was cut."""
        if not resume:
            guest.seed(self.seed)
            task.begin()
            return
        with Recording(self.out) as recording:
            begun = recording.n_states > 0
            poses = recording.object_poses[-1] if begun else None
            joints = recording.states["joint_positions"][-1] if begun else None
            state = recording.controller_state()
            n_cuts = len(recording.cuts) + 1 if begun else 0
        # A controller that hands over no state must not play the same actions once more.
        guest.seed(derived_seed(self.seed, n_cuts) if n_cuts else self.seed)
        guest.set_state(state)
        task.begin(object_poses=poses, joint_positions=joints)

    def _play(
        self, task: Task, guest: Guest, recorder: Recorder, report: Report, stop: StopRequest
    ) -> None:
        try:
            self._play_actions(task, guest, recorder, report, stop)
        except (ControllerError, PhysicsError, KeyboardInterrupt):
            recorder.write(guest.get_state())  # up to the last whole action
            raise
        recorder.write(guest.get_state())
        if recorder.n_steps < self.steps:
            raise Interrupted(
                f"stopped at step {recorder.n_steps:,} of {self.steps:,}; everything up to here is "
                f"in {self.out}: go on with --resume"
            )

    def _play_actions(
        self, task: Task, guest: Guest, recorder: Recorder, report: Report, stop: StopRequest
    ) -> None:
        guest.call("start_intrinsic_phase")
        player = guest.at_play(task)
        poses = recorder.add_state(task)
        n_actions = n_moved = 0
        while recorder.n_steps < self.steps and not stop.made:
            action = player.play(self.steps - recorder.n_steps)
            before, poses = poses, recorder.add_transition(action, task)
            n_actions, n_moved = n_actions + 1, n_moved + _moved(before, poses)
            if recorder.is_due:
                recorder.write(guest.get_state())
            report(Progress(recorder.n_steps, self.steps, n_actions, n_moved))
        if recorder.n_steps >= self.steps:
            guest.call("end_intrinsic_phase", task.observe().now(), 0.0, True)

    def _recorder(self, header: Header, task: Task, resume: bool) -> Recorder:
        make = Recorder.resume if resume else Recorder.begin
        return make(self.out, header, task, self.steps)

    def _is_complete(self) -> bool:
        with Recording(self.out) as recording:
            return recording.n_steps >= self.steps

    def _header(self, kind: type[Any]) -> Header:
        return Header(
            condition=self.condition.name,
            objects=self.objects,
            object_names=self.scene.object_names(self.objects),
            scene=self.scene.name,
            scene_source=self.scene.source,
            scene_sha256=self.scene.sha256,
            seed=self.seed,
            controller=self.controller,
            controller_sha256=source_sha256(kind),
            images=self._records_images,
            versions=package_versions(),
        )

    @property
    def _records_images(self) -> bool:
        return not self.condition.sees_objects if self.images is None else self.images

    def _check_resumable(self, header: Header) -> None:
        with Recording(self.out) as recording:
            differences = recording.header.differences(header, RESUMED_ALIKE)
            n_steps = recording.n_steps
        if differences:
            raise RecordingError(
                f"{self.out} cannot be resumed, it was recorded with other settings: "
                + "; ".join(differences)
            )
        if n_steps > self.steps:
            raise RecordingError(
                f"{self.out} already holds {n_steps:,} steps, {self.steps:,} asked"
            )


def _moved(before: NDArray[np.float64], after: NDArray[np.float64]) -> bool:
    return bool((np.linalg.norm(after[:, :3] - before[:, :3], axis=1) > MOVED_M).any())
