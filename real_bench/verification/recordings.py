"""Verify a recording of an intrinsic phase by replaying its actions from the start."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from real_bench.conditions import Condition
from real_bench.errors import ActionError, Interrupted, PhysicsError, RecordingError
from real_bench.inputs.whole import keep_whole
from real_bench.phases.stopping import StopRequest, stop_requests
from real_bench.recording import Recording
from real_bench.recording.schema import IMAGES_PER_CHUNK
from real_bench.replay import ActionReplayer, fresh_states
from real_bench.simulation.scene import load_scene
from real_bench.task import Task
from real_bench.verification.consistency import (
    commands_match_hash,
    contradictions,
)
from real_bench.verification.differences import (
    TOLERANCE_M,
    Difference,
    attribute_to_physics,
    numbers_differ,
    poses_differ,
)
from real_bench.verification.verdicts import RecordingVerdict
from real_bench.verification.versions import Physics, versions_differ

OnReplay = Callable[[int, int], None]


@dataclass(frozen=True)
class RecordingVerification:
    """A recording to be verified.

    Attributes:
        path: the recording.
        scene: its scene, a name or manifest; None: the one that the recording names.
        n_steps: replay only actions that begin within this many first steps; None: all.
        images: whether images are also rendered and compared.
    """

    path: Path
    scene: str | None = None
    n_steps: int | None = None
    images: bool = False

    def __post_init__(self) -> None:
        if self.n_steps is not None:
            keep_whole(self, "n_steps", 1, error=RecordingError)

    def verify(self, report: OnReplay) -> RecordingVerdict:
        """Replay it, up to the first state that differs.

        Args:
            report: called at first and after each action with the steps replayed and their total.

        Raises:
            RecordingError: it cannot be read, or has nothing to replay, or no images.
            SceneError: its scene is not available.
            Interrupted: the user stopped it.
        """
        with Recording(self.path) as recording:
            self._check_replayable(recording)
            header, parts = recording.header, [Physics.of(part) for part in recording.parts]
            condition = Condition.parse(header.condition)
            if mismatch := condition.control_mismatch(header.control_version):
                raise RecordingError(f"{self.path} cannot be replayed: {mismatch}")
            scene = load_scene(header.scene_source if self.scene is None else self.scene)
            faults = list(contradictions(recording, scene))
            with closing(Task(scene, condition, header.objects)) as task:
                replay = _Replay(recording, task, self.images, parts)
                if not faults:
                    replay.run(self.n_steps or recording.n_steps, report)
            # A hash of all commands can be checked only if all are replayed.
            if not (faults or self.n_steps or commands_match_hash(recording)):
                faults.append("its commands do not match their hash")
            return RecordingVerdict(
                path=self.path,
                n_actions=replay.n_actions,
                n_steps=replay.n_steps,
                n_states=replay.n_states,
                total_steps=recording.n_steps,
                images=self.images,
                where=replay.where,
                differences=replay.differences,
                faults=tuple(faults),
                notes=tuple(_notes(recording, parts)),
                physics=replay.reported_physics,
            )

    def _check_replayable(self, recording: Recording) -> None:
        if not len(recording.transitions):
            raise RecordingError(f"{self.path} has no action yet: nothing to verify")
        if self.images and recording.n_images is None:
            raise RecordingError(f"{self.path} was recorded without images")


def _notes(recording: Recording, parts: Sequence[Physics]) -> Iterator[str]:
    yield from versions_differ(recording.header.versions)
    yield from dict.fromkeys(note for part in parts for note in part.notes())
    if recording.commands_sha256 is None:
        yield (
            "it was recorded before commands were hashed: a change without any effect would not "
            "be found"
        )


class _Replay:
    """Goes from state to state: each is the outcome of an action, or begins a fresh world.

    Attributes:
        n_actions, n_steps, n_states: how much was replayed and agrees.
        where, differences: the first state that differs; empty if there is none.
        physics: of the part being replayed.
        reported_physics: of the first part that was made with different physics, if any.
    """

    def __init__(
        self, recording: Recording, task: Task, images: bool, parts: Sequence[Physics]
    ) -> None:
        self._recording, self._task = recording, task
        self._replayer = ActionReplayer(recording, task)
        self._names = recording.header.object_names
        self._states, self._poses = recording.states, recording.object_poses
        self._images = _Images(recording) if images else None
        self.n_actions = self.n_steps = self.n_states = 0
        self._parts = iter(parts)
        self.physics = self.reported_physics = parts[0]
        self.where = ""
        self.differences: tuple[Difference, ...] = ()

    def run(self, n_steps: int, report: OnReplay) -> None:
        """Replay the actions that begin within the first steps, or up to the first difference."""
        with stop_requests() as stop:
            self._run(n_steps, report, stop)

    def _run(self, n_steps: int, report: OnReplay, stop: StopRequest) -> None:
        fresh = set(fresh_states(self._recording).tolist())
        rows = self._recording.transitions
        n_commanded = int((rows["first_step"] < n_steps).sum())
        n_total = int(rows["n_steps"][:n_commanded].sum())
        for state in range(self._recording.n_states):
            if state not in fresh and self.n_actions == n_commanded:
                return
            if stop.requested:
                raise Interrupted(f"stopped after {self.n_steps:,} of {n_total:,} steps")
            self.differences = tuple(self._begin(state) if state in fresh else self._act(state))
            if self.differences:
                self.where = self._describe_step(state, state in fresh)
                return
            self.n_states += 1
            report(self.n_steps, n_total)

    def _begin(self, state: int) -> Iterator[Difference]:
        """A fresh world: the scene's own, or after a cut as the state before was recorded."""
        self.physics = next(self._parts, self.physics)
        if not self.reported_physics.differs:
            self.reported_physics = self.physics
        self._replayer.begin(state)
        yield from self._compare_state(state)

    def _act(self, state: int) -> Iterator[Difference]:
        """The next action, which leads to a state."""
        try:
            action = self._replayer.act(self.n_actions)
        except (ActionError, PhysicsError) as error:
            by_physics = self.physics.differs and isinstance(error, PhysicsError)
            yield Difference(f"its commands cannot be replayed: {error}", of_physics=by_physics)
            return
        found = list(self._compare_state(state))
        if not found:
            self.n_actions, self.n_steps = self.n_actions + 1, self.n_steps + action.duration
        yield from found

    def _compare_state(self, state: int) -> Iterator[Difference]:
        simulation, row = self._task.simulation, self._states[state]
        try:
            joints, poses = simulation.joint_positions(), simulation.object_poses()
        except PhysicsError as error:
            yield Difference(str(error), of_physics=self.physics.differs)
            return
        angles = row["joint_positions"]
        if self.physics.differs:  # touch and pixels, which are all or nothing, are not compared
            yield from attribute_to_physics(
                chain(
                    numbers_differ("joint angle", angles, joints, "rad", within=TOLERANCE_M),
                    poses_differ(self._poses[state], poses, self._names, within=TOLERANCE_M),
                )
            )
            return
        yield from numbers_differ("joint angle", angles, joints, "rad")
        yield from numbers_differ("touch", row["touch_sensors"], simulation.touch_sensors(), "N")
        yield from poses_differ(self._poses[state], poses, self._names)
        if self._images:
            yield from _image_differs(self._images[state], simulation.image().retina)

    def _describe_step(self, state: int, fresh: bool) -> str:
        step = int(self._states["step"][state])
        if fresh:
            return f"the world that begins at step {step:,}"
        row = self._recording.transitions[self.n_actions]
        return f"action {self.n_actions:,} (steps {row['first_step']:,} to {step:,})"


class _Images:
    """The recorded images, read by whole chunks."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._first = -IMAGES_PER_CHUNK
        self._chunk: NDArray[np.uint8] = np.empty(0, np.uint8)

    def __getitem__(self, state: int) -> NDArray[np.uint8]:
        if not 0 <= state - self._first < IMAGES_PER_CHUNK:
            self._first = state - state % IMAGES_PER_CHUNK
            self._chunk = self._recording.images(self._first, IMAGES_PER_CHUNK)
        image: NDArray[np.uint8] = self._chunk[state - self._first]
        return image


def _image_differs(
    recorded: NDArray[np.uint8], replayed: NDArray[np.uint8]
) -> Iterator[Difference]:
    if recorded.shape != replayed.shape:
        yield Difference(f"image is of shape {recorded.shape}, not {replayed.shape}")
    elif (recorded != replayed).any():
        pixels = np.asarray(recorded != replayed).any(axis=-1).sum()
        yield Difference("image", float(pixels), "pixels")
