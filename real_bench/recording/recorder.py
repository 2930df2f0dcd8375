"""Collect what happens in an intrinsic phase, and write it every few seconds."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action
from real_bench.errors import RecordingError
from real_bench.files.kinds import RECORDING
from real_bench.files.outputs import check_output
from real_bench.logbook import Entry
from real_bench.recording.header import Header
from real_bench.recording.reader import Recording
from real_bench.recording.schema import (
    CUT,
    LOGGED,
    STATE,
    TRANSITION,
    Batch,
    chained_sha256,
    command_type,
)
from real_bench.recording.state import ControllerState, check_state
from real_bench.recording.writer import AppendOnlyFile
from real_bench.simulation.manifest import CameraSpec

SECONDS_BETWEEN_WRITES = 3.0


@dataclass(frozen=True, eq=False)
class ResumePoint:
    """Where a resumed recording ended.

    Attributes:
        object_poses, joint_positions: of its last state; a fresh world begins there.
        controller_state: what the controller handed over then.
        code_sha256: the hash of its code then.
        number: how often the run has been interrupted.
    """

    object_poses: NDArray[np.float64]
    joint_positions: NDArray[np.float64]
    controller_state: ControllerState
    code_sha256: str
    number: int


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A moment as it is recorded.

    Attributes:
        joint_positions: (9,), rad.
        touch_sensors: (4,), N.
        object_poses: (n_objects, 7), positions in metres and quaternions.
        retina: (height, width, 3) uint8; None if images are not recorded.
    """

    joint_positions: NDArray[np.float64]
    touch_sensors: NDArray[np.float64]
    object_poses: NDArray[np.float64]
    retina: NDArray[np.uint8] | None


class Recorder:
    """The triplets of one run, and the controller's state that belongs to them.

    Rows are collected; :meth:`checkpoint` declares that the controller's state fits the rows so
    far. Only rows before a checkpoint are ever written, so a run that is resumed from any file
    continues with the action after its last row.

    Make one with :meth:`begin` or :meth:`resume`; use it as a context manager.
    """

    def __init__(self, file: AppendOnlyFile, header: Header, command_size: int, steps: int) -> None:
        self._file = file
        self._header = header
        self._total_steps = steps
        self._command_type = command_type(command_size)
        self._commands_sha256: str | None = ""
        self.n_steps = self.n_transitions = 0
        self.ended = False
        self.resume_point: ResumePoint | None = None
        self._n_states = self._n_commands = 0
        self._rows = _Rows()
        self._files: Mapping[str, bytes] | None = None  # not written yet
        self._checkpoint: tuple[dict[str, int], int, ControllerState, bool] | None = None
        self._unwritten: tuple[Batch, _Rows] | None = None  # and the rows after it
        self._next_write = time.monotonic() + SECONDS_BETWEEN_WRITES

    @classmethod
    def begin(
        cls,
        path: Path,
        header: Header,
        command_size: int,
        steps: int,
        camera: CameraSpec,
        *,
        overwrite: bool,
    ) -> Recorder:
        """Begin a new recording of ``steps`` steps.

        Raises:
            OutputError: the file exists and must not be overwritten.
        """
        file = AppendOnlyFile(path)
        try:
            check_output(
                path, overwrite=overwrite, kind=RECORDING, remedy="--resume or --overwrite"
            )
            file.create(header, command_size, camera)
        except BaseException:
            file.close()
            raise
        return cls(file, header, command_size, steps)

    @classmethod
    def resume(cls, path: Path, header: Header, command_size: int, steps: int) -> Recorder:
        """Continue a recording after its last action; ``header`` is that of the new part.

        It must have a state to continue from.

        Raises:
            RecordingError: the recording has other settings, or is longer than ``steps``.
        """
        file = AppendOnlyFile(path)
        try:
            with Recording(path) as recording:
                _check_resumable(recording, header, steps)
                recorder = cls(file, recording.header, command_size, steps)
                recorder._continue_from(recording, header)
        except BaseException:
            file.close()
            raise
        return recorder

    @property
    def has_images(self) -> bool:
        """Whether images are recorded."""
        return self._header.images

    def add_state(self, now: Snapshot) -> None:
        """Record the present state."""
        self._rows.states.append((now.joint_positions, now.touch_sensors, self.n_steps))
        self._rows.object_poses.append(now.object_poses)
        if now.retina is not None:
            self._rows.images.append(now.retina)
        self._n_states += 1

    def add_transition(self, action: Action, outcome: Snapshot) -> None:
        """Record an action that was executed, and its outcome."""
        k, first_step = len(action.commands), self.n_steps
        self._rows.commands += zip(action.commands, action.n_steps, action.line, strict=True)
        self._rows.transitions.append(
            (self._n_states - 1, self._n_states, self._n_commands, k, first_step, action.duration)
        )
        self._n_commands += k
        self.n_transitions += 1
        self.n_steps += action.duration
        self.add_state(outcome)

    def add_logged(self, entries: Iterable[Entry]) -> None:
        """Record what the controller has logged up to the last action."""
        self._rows.logged += [
            (self.n_steps, self.n_transitions, name.encode(), value) for name, value in entries
        ]

    @property
    def is_due(self) -> bool:
        """Whether it is time to write."""
        return time.monotonic() >= self._next_write

    def checkpoint(self, controller_state: ControllerState, *, ended: bool = False) -> None:
        """The controller's state after the last row; ``ended``: the phase's last hook is over."""
        check_state(controller_state)
        self._checkpoint = (self._rows.lengths(), self.n_steps, controller_state, ended)

    def keep_files(self, files: Mapping[str, bytes]) -> None:
        """What the controller has written into its working directory, by name."""
        self._files = files

    def write(self) -> None:
        """Write the rows up to the last checkpoint.

        If it is interrupted, calling it again writes what is missing, and nothing twice.
        """
        if self._unwritten is None:
            if self._checkpoint is None:
                return
            lengths, n_steps, state, ended = self._checkpoint
            batch = self._batch(self._rows.first(lengths), n_steps, state, ended)
            self._unwritten = batch, self._rows.after(lengths)
        batch, later = self._unwritten
        self._file.append(batch)
        self._commands_sha256 = batch.commands_sha256
        self._rows = later
        self._checkpoint = self._files = None
        self._next_write = time.monotonic() + SECONDS_BETWEEN_WRITES
        self._unwritten = None

    def close(self) -> None:
        """Close the file; what was not written is lost."""
        self._file.close()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _continue_from(self, recording: Recording, header: Header) -> None:
        """Begin where a recording ended."""
        self.n_steps = recording.n_steps
        self.n_transitions = len(recording.transitions)
        self.ended = recording.ended and self.n_steps >= self._total_steps
        self._n_states, self._n_commands = recording.n_states, recording.n_commands
        self._commands_sha256 = recording.commands_sha256
        self.resume_point = ResumePoint(
            object_poses=recording.object_poses[-1],
            joint_positions=recording.states["joint_positions"][-1],
            controller_state=recording.controller_state(),
            code_sha256=recording.code_sha256,
            number=len(recording.cuts) + 1,
        )
        if self.n_steps < self._total_steps:
            versions = json.dumps(header.versions).encode()
            self._rows.cuts.append((self.n_steps, header.controller_sha256.encode(), versions))

    def _batch(self, rows: _Rows, n_steps: int, state: ControllerState, ended: bool) -> Batch:
        transitions = np.array(rows.transitions, TRANSITION)
        commands = np.array(rows.commands, self._command_type)
        before = self._commands_sha256
        return Batch(
            transitions=transitions,
            commands=commands,
            states=np.array(rows.states, STATE),
            images=np.array(rows.images, np.uint8) if rows.images else None,
            object_poses=np.array(rows.object_poses).reshape(-1, self._header.objects, 7),
            cuts=np.array(rows.cuts, CUT),
            logged=np.array(rows.logged, LOGGED),
            n_steps=n_steps,
            total_steps=self._total_steps,
            ended=ended,
            controller_state=state,
            controller_files=self._files,
            commands_sha256=(
                None
                if before is None
                else chained_sha256(before, transitions["n_commands"], commands)
            ),
        )


@dataclass
class _Rows:
    """Rows that wait to be written, by dataset."""

    transitions: list[tuple[int, ...]] = field(default_factory=list)
    commands: list[tuple[Any, ...]] = field(default_factory=list)
    states: list[tuple[Any, ...]] = field(default_factory=list)
    images: list[NDArray[np.uint8]] = field(default_factory=list)
    object_poses: list[NDArray[np.float64]] = field(default_factory=list)
    cuts: list[tuple[int, bytes, bytes]] = field(default_factory=list)
    logged: list[tuple[int, int, bytes, float]] = field(default_factory=list)

    def lengths(self) -> dict[str, int]:
        """How many rows there are of each."""
        return {name: len(rows) for name, rows in vars(self).items()}

    def first(self, lengths: dict[str, int]) -> _Rows:
        """The first rows of each."""
        return _Rows(**{name: getattr(self, name)[:n] for name, n in lengths.items()})

    def after(self, lengths: dict[str, int]) -> _Rows:
        """The rows of each after the first."""
        return _Rows(**{name: getattr(self, name)[n:] for name, n in lengths.items()})


def _check_resumable(recording: Recording, header: Header, steps: int) -> None:
    differences = recording.header.differences(header)
    if differences:
        raise RecordingError(
            f"{recording.path} was recorded with other settings and cannot be resumed: "
            + "; ".join(differences)
        )
    if recording.n_steps > steps:
        raise RecordingError(
            f"{recording.path} already holds {recording.n_steps:,} steps, {steps:,} were asked "
            "for: use a larger --steps"
        )
