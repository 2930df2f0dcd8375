"""The intrinsic phase: free play, recorded (paper, section Scenario)."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.conditions import Condition
from real_bench.controller_code.source import recorded_name, resolved
from real_bench.errors import Interrupted, RealBenchError, RecordingError, StateError
from real_bench.files.kinds import RECORDING
from real_bench.files.outputs import check_output
from real_bench.inputs.whole import keep_whole
from real_bench.lengths import LARGEST
from real_bench.phases.activity import LEARNING, Activity, ignore_activity
from real_bench.phases.local import LocalBackend
from real_bench.phases.player import make_player
from real_bench.phases.proxy import (
    NO_FILES,
    ControllerBackend,
    ControllerProxy,
    Identity,
    close_on_error,
)
from real_bench.phases.seeds import derived_seed
from real_bench.phases.stopping import StopRequest, stop_requests
from real_bench.provenance import run_versions
from real_bench.recording import (
    MOVED_M,
    Experience,
    Header,
    Recorder,
    Recording,
    Snapshot,
)
from real_bench.simulation.scene import Scene
from real_bench.task import Task


@dataclass(frozen=True)
class Progress:
    """The progress of a phase.

    Attributes:
        n_steps: simulation steps so far, of ``total_steps``.
        n_actions: actions in this process, of which ``n_moved`` displaced an object by > 1 cm.
    """

    n_steps: int
    total_steps: int
    n_actions: int
    n_moved: int


OnPlay = Callable[[Progress], None]

log = logging.getLogger(__name__)

NEVER_TAKEN = "what get_state() hands over is never taken: define set_state(), too"


@dataclass(frozen=True)
class IntrinsicPhase:
    """An intrinsic phase to run.

    Attributes:
        controller: name, ``module:Class`` or file.
        condition: two letters, as in the paper.
        objects: number of objects.
        scene: name or manifest.
        steps: how long the phase lasts, from its very beginning.
        seed: of the controller's randomness.
        out: the recording.
        images: record the camera image of every state; None: in image conditions, and where the
            controller uses them.
        settings: values for the controller's settings; the rest are its defaults.
        backend: where the controller runs.
    """

    controller: str
    condition: Condition
    objects: int
    scene: Scene
    steps: int
    seed: int
    out: Path
    images: bool | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    backend: ControllerBackend = field(default_factory=LocalBackend)

    def __post_init__(self) -> None:
        keep_whole(self, "steps", 1, LARGEST)
        keep_whole(self, "seed", 0, LARGEST)
        if self.images is False and not self.condition.sees_objects:
            raise RealBenchError(
                f"condition {self.condition.name} needs images: leave out --no-images"
            )
        object.__setattr__(self, "objects", len(self.scene.object_names(self.objects)))

    def run(
        self,
        report: OnPlay,
        *,
        resume: bool = False,
        overwrite: bool = False,
        activity: Activity = ignore_activity,
    ) -> ControllerProxy:
        """Play to the end; returns the controller as it is then.

        Args:
            report: called with the progress after every action.
            resume: continue the recording if it exists.
            overwrite: replace the recording if it exists.
            activity: called with what the controller is busy with.

        Raises:
            Interrupted: the user stopped it; ``resume`` continues.
            ControllerError: the controller failed; what was recorded before is kept.
            RealBenchError: anything else that is wrong, before or while it runs.
        """
        resume = resume and self.out.exists()
        check_output(
            self.out,
            overwrite=overwrite or resume,
            kind=RECORDING,
            remedy="--resume or --overwrite",
        )
        task = Task(self.scene, self.condition, self.objects)
        try:
            proxy = self.backend.proxy(self.controller, self.settings, task, self._files(resume))
            with close_on_error(proxy), stop_requests() as stop:
                if not proxy.identity.learns_across_trials:
                    proxy.copy().close()  # report one that cannot be copied before it plays
                log.info("controller: %s", proxy.identity)
                self._log_what_is_lost(proxy.identity)
                header = self._header(proxy.identity)
                with self._recorder(header, resume, overwrite) as recorder:
                    with activity(LEARNING):
                        self._begin(task, proxy, recorder)
                    if not recorder.ended:
                        play = _Play(task, proxy, recorder, self.steps, self.out, activity)
                        play.run(report, stop)
        finally:
            task.close()
        return proxy

    def _log_what_is_lost(self, identity: Identity) -> None:
        if not (identity.hands_over_state or identity.learns_from_experience):
            log.info(
                "it has neither get_state() nor use_experience(): if it learns, only "
                "`realbench evaluate` tests what it learned"
            )
        elif identity.hands_over_state and not identity.takes_state:
            log.warning("%s", NEVER_TAKEN)

    def _files(self, resume: bool) -> Mapping[str, bytes]:
        if not resume:
            return NO_FILES
        with Recording(self.out) as recording:
            return recording.controller_files()

    def _recorder(self, header: Header, resume: bool, overwrite: bool) -> Recorder:
        size = self.condition.control_type.size
        if resume and _has_begun(self.out):
            recorder = Recorder.resume(self.out, header, size, self.steps)
            point = recorder.resume_point
            if point is not None and point.code_sha256 != header.controller_sha256:
                log.warning(
                    "the controller's code is not that of before step %s: what follows is played "
                    "by other code (realbench inspect tells where)",
                    f"{recorder.n_steps:,}",
                )
            return recorder
        camera, replace = self.scene.manifest.camera, overwrite or resume
        return Recorder.begin(self.out, header, size, self.steps, camera, overwrite=replace)

    def _begin(self, task: Task, proxy: ControllerProxy, recorder: Recorder) -> None:
        """Put world and controller at the start of the phase, or where it was interrupted."""
        point = recorder.resume_point
        if point is None:
            proxy.seed(self.seed)
            task.begin()
            return
        # A controller that hands over no state must not play the same actions once more.
        proxy.seed(derived_seed(self.seed, point.number))
        proxy.set_state(point.controller_state)
        if recorder.n_steps < self.steps:
            proxy.call("resume_intrinsic_phase", Experience(self.out, self.condition))
        task.begin(object_poses=point.object_poses, joint_positions=point.joint_positions)

    def _header(self, identity: Identity) -> Header:
        source = resolved(self.controller)
        for place in (source, self.scene.source):
            if not place.isprintable():
                raise RecordingError(
                    f"a recording cannot store the path {place!r}: rename its folder"
                )
        return Header(
            condition=self.condition.name,
            control_version=self.condition.control_version,
            objects=self.objects,
            object_names=self.scene.object_names(self.objects),
            scene=self.scene.name,
            scene_source=self.scene.source,
            scene_sha256=self.scene.sha256,
            seed=self.seed,
            controller=recorded_name(self.controller),
            controller_source=source,
            controller_class=identity.class_name,
            controller_sha256=identity.code_sha256,
            settings=dict(identity.settings),
            images=self._records_images(identity.uses_images),
            versions=run_versions(),
        )

    def _records_images(self, uses_images: bool) -> bool:
        if self.images is False and uses_images:
            raise RealBenchError(
                f"controller {self.controller} learns from images: leave out --no-images"
            )
        if self.images is None:
            return uses_images or not self.condition.sees_objects
        return self.images


MAX_CHECKPOINT_INTERVAL_S = 10.0


@contextmanager
def without_hints() -> Iterator[None]:
    """Do not say how a play that fails can go on: its recording is not kept."""

    def refuse(_: logging.LogRecord) -> bool:
        return False

    log.addFilter(refuse)
    try:
        yield
    finally:
        log.removeFilter(refuse)


class _Play:
    """The play itself, from wherever the phase is."""

    def __init__(
        self,
        task: Task,
        proxy: ControllerProxy,
        recorder: Recorder,
        steps: int,
        out: Path,
        activity: Activity,
    ) -> None:
        self._task, self._proxy, self._recorder = task, proxy, recorder
        self._steps, self._out = steps, out
        self._learning = partial(activity, LEARNING)
        self._player = make_player(proxy, task, self._learning)
        self._next_checkpoint = 0.0

    def run(self, report: OnPlay, stop: StopRequest) -> None:
        """Play until the steps are over or a stop is requested; write what happened."""
        recorder = self._recorder
        with self._learning():
            self._proxy.call("start_intrinsic_phase")
        try:
            if recorder.n_steps < self._steps:
                self._play(report, stop)
            recorder.keep_files(self._proxy.get_files())
            self._checkpoint()
            if recorder.n_steps >= self._steps:
                with self._learning():
                    self._proxy.call("end_intrinsic_phase", self._player.look(), 0, True)
                recorder.add_logged(self._proxy.take_logged())
                self._checkpoint()
                recorder.write()
                with self._learning():
                    experience = Experience(self._out, self._task.condition)
                    self._proxy.call("use_experience", experience)
                recorder.add_logged(self._proxy.take_logged())
                recorder.keep_files(self._proxy.get_files())
                self._checkpoint(ended=True)
        except RecordingError:
            raise  # it could not be written before, and cannot now
        except BaseException as error:
            recorder.write()
            if recorder.n_steps and isinstance(error, Exception):  # not a wish to stop at once
                log.warning(
                    "%s steps are recorded in %s: once what fails is mended, --resume continues",
                    f"{recorder.n_steps:,}",
                    self._out,
                )
            raise
        recorder.write()
        if recorder.n_steps == 0:
            raise Interrupted("stopped before the first action: nothing was recorded")
        if recorder.n_steps < self._steps:
            raise Interrupted(
                f"stopped at step {recorder.n_steps:,} of {self._steps:,}; everything up to here "
                "is recorded",
                can_resume=True,
            )

    def _play(self, report: OnPlay, stop: StopRequest) -> None:
        recorder = self._recorder
        now = self._snapshot()
        recorder.add_state(now)
        n_actions = n_moved = 0
        while recorder.n_steps < self._steps and not stop.requested:
            action = self._player.play(self._steps - recorder.n_steps)
            before, now = now, self._snapshot()
            recorder.add_transition(action, now)
            recorder.add_logged(self._proxy.take_logged())
            n_actions += 1
            n_moved += _moved(before.object_poses, now.object_poses)
            self._checkpoint_if_cheap()
            if recorder.is_due:
                recorder.write()
            report(Progress(recorder.n_steps, self._steps, n_actions, n_moved))

    def _snapshot(self) -> Snapshot:
        simulation = self._task.simulation
        return Snapshot(
            simulation.joint_positions(),
            simulation.touch_sensors(),
            simulation.object_poses(),
            simulation.image().retina if self._recorder.has_images else None,
        )

    def _checkpoint(self, *, ended: bool = False) -> None:
        try:
            self._recorder.checkpoint(self._proxy.get_state(), ended=ended)
        except StateError as error:
            raise StateError(f"controller {self._proxy.spec}: get_state(): {error}") from error

    def _checkpoint_if_cheap(self) -> None:
        """Take the controller's state: as often as it costs little, and every ten seconds."""
        began = time.monotonic()
        if began >= self._next_checkpoint:
            self._checkpoint()
            now = time.monotonic()
            self._next_checkpoint = now + min(99 * (now - began), MAX_CHECKPOINT_INTERVAL_S)


def _has_begun(run: Path) -> bool:
    """Whether a recording holds anything; one killed before its first action holds nothing."""
    with Recording(run) as recording:
        return bool(recording.n_states)


def _moved(before: NDArray[np.float64], after: NDArray[np.float64]) -> bool:
    return bool((np.linalg.norm(after[:, :3] - before[:, :3], axis=1) > MOVED_M).any())
