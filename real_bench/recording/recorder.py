"""Collects what happens in an intrinsic phase and writes it every few seconds."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action
from real_bench.recording.header import Header
from real_bench.recording.reader import Recording
from real_bench.recording.schema import CUT, STATE, TRANSITION, Batch, command_type
from real_bench.recording.state import State, check_state
from real_bench.recording.writer import AppendOnlyFile
from real_bench.task import Task

SECONDS_BETWEEN_WRITES = 3.0


class Recorder:
    """The triplets of one run.

    Make one with :meth:`begin` or :meth:`resume`; use it as a context manager, so that what has
    been collected is written however the phase ends.
    """

    def __init__(self, file: AppendOnlyFile, header: Header, command_size: int, steps: int) -> None:
        self._file = file
        self._header = header
        self._total_steps = steps
        self._command_type = command_type(command_size)
        self.n_steps = 0
        self.n_transitions = 0
        self._n_states = 0
        self._n_commands = 0
        self._clear()

    @classmethod
    def begin(cls, path: Path, header: Header, task: Task, steps: int) -> Recorder:
        """Begin a new recording of so many steps; a file that is there is replaced."""
        file = AppendOnlyFile(path)
        size = task.control.size
        file.create(header, size, task.simulation.scene.manifest.camera)
        return cls(file, header, size, steps)

    @classmethod
    def resume(cls, path: Path, header: Header, task: Task, steps: int) -> Recorder:
        """Go on with a recording, from its last action; ``header`` is that of the new part."""
        file = AppendOnlyFile(path)
        with Recording(path) as recording:
            recorder = cls(file, recording.header, task.control.size, steps)
            recorder.n_steps = recording.n_steps
            recorder.n_transitions = len(recording.transitions)
            recorder._n_states = recording.n_states
            recorder._n_commands = len(recording.commands)
        if recorder.n_transitions:
            versions = json.dumps(header.versions).encode()
            cut = (recorder.n_steps, header.controller_sha256.encode(), versions)
            recorder._cuts.append(cut)
        return recorder

    def add_state(self, task: Task) -> NDArray[np.float64]:
        """Record what is the case now; returns the objects' poses."""
        simulation = task.simulation
        poses = simulation.object_poses()
        self._states.append(
            (simulation.joint_positions(), simulation.touch_sensors(), self.n_steps)
        )
        self._poses.append(poses)
        if self._header.images:
            self._images.append(simulation.image().retina)
        self._n_states += 1
        return poses

    def add_transition(self, action: Action, task: Task) -> NDArray[np.float64]:
        """Record an action that was executed, and its outcome; returns the objects' poses."""
        k, first_step = len(action.commands), self.n_steps
        self._commands += zip(action.commands, action.n_steps, action.line, strict=True)
        self._transitions.append(
            (self._n_states - 1, self._n_states, self._n_commands, k, first_step, action.duration)
        )
        self._n_commands += k
        self.n_transitions += 1
        self.n_steps += action.duration
        return self.add_state(task)

    @property
    def is_due(self) -> bool:
        """Whether it is time to write."""
        return time.monotonic() >= self._next_write

    def write(self, controller_state: State) -> None:
        """Write what has been collected, with the controller's state at this very moment."""
        check_state(controller_state)
        self._file.append(self._batch(controller_state))
        self._clear()

    def close(self) -> None:
        """Let go of the file; what was not written is lost."""
        self._file.close()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _batch(self, controller_state: State) -> Batch:
        n_objects = self._header.objects
        return Batch(
            transitions=np.array(self._transitions, TRANSITION),
            commands=np.array(self._commands, self._command_type),
            states=np.array(self._states, STATE),
            images=np.array(self._images, np.uint8) if self._images else None,
            object_poses=np.array(self._poses).reshape(-1, n_objects, 7),
            cuts=np.array(self._cuts, CUT),
            n_steps=self.n_steps,
            total_steps=self._total_steps,
            controller_state=controller_state,
        )

    def _clear(self) -> None:
        self._transitions: list[tuple[int, ...]] = []
        self._commands: list[tuple[Any, ...]] = []
        self._states: list[tuple[Any, ...]] = []
        self._images: list[NDArray[np.uint8]] = []
        self._poses: list[NDArray[np.float64]] = []
        self._cuts: list[tuple[int, bytes, bytes]] = []
        self._next_write = time.monotonic() + SECONDS_BETWEEN_WRITES
