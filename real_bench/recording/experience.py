"""The triplets of a run as its condition lets a controller see them."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action
from real_bench.conditions import Condition
from real_bench.errors import RecordingError
from real_bench.recording.reader import Recording
from real_bench.recording.schema import IMAGES_PER_CHUNK


class Experience:
    """The experience of a robot: triplets (s, a, s') of precondition, action, outcome.

    Without O in the condition there are no positions, whatever the file holds.

    Args:
        path: a recording; it is opened again for images, and for the commands.
        condition: what the controller may see.
        n_steps: only this many first steps; None: all.

    Attributes:
        path, condition, n_steps: as given, so that it can be made again elsewhere.
        sees_objects: whether there are positions and orientations.
        object_names: their names, in order.
        durations: how many steps each action lasted, (n,); the last one may have been cut short.
        preconditions: the number of the state that each action began in, (n,); actions share
            states.
        outcomes: the number of the state that each action led to, (n,).
        n_states: how many states there are.
        joint_positions: of the robot in every state, (n_states, 9) radians.
    """

    def __init__(
        self, path: str | Path, condition: str | Condition, n_steps: int | None = None
    ) -> None:
        if isinstance(condition, str):
            condition = Condition.parse(condition)
        self.path, self.condition, self.n_steps = Path(path), condition, n_steps
        with Recording(path) as recording:
            rows = recording.transitions
            if n_steps is not None:
                rows = rows[rows["first_step"] + rows["n_steps"] <= n_steps]
            whole = len(rows) == len(recording.transitions)
            self.n_states = (
                recording.n_states if whole else int(rows["outcome"].max(initial=-1)) + 1
            )
            recorded = Condition.parse(recording.header.condition)
            self.sees_objects = condition.sees_objects and recorded.sees_objects
            self.object_names = recording.header.object_names
            self._poses = recording.object_poses if self.sees_objects else None
            joints = recording.states["joint_positions"][: self.n_states]
            self.joint_positions: NDArray[np.float64] = joints
        self._first_state = 0  # of the recording's
        self.preconditions: NDArray[np.int64] = rows["precondition"]
        self.outcomes: NDArray[np.int64] = rows["outcome"]
        self.durations: NDArray[np.int64] = rows["n_steps"]
        self._first_commands, self._n_commands = rows["first_command"], rows["n_commands"]
        self._freeze()

    def __deepcopy__(self, memo: object) -> Experience:
        return self  # it never changes, so copies of a controller may share it

    def __len__(self) -> int:
        return len(self.preconditions)

    def since(self, first: int) -> Experience:
        """What followed the first actions; its first state is the one that the next began in."""
        part = copy.copy(self)
        first = min(first, len(self))
        state = self.preconditions[first] if first < len(self) else self.n_states
        part._first_state += int(state)
        part.n_states -= int(state)
        part.joint_positions = self.joint_positions[state:]
        part._poses = None if self._poses is None else self._poses[state:]
        part.preconditions = self.preconditions[first:] - state
        part.outcomes = self.outcomes[first:] - state
        part.durations = self.durations[first:]
        part._first_commands = self._first_commands[first:]
        part._n_commands = self._n_commands[first:]
        part._freeze()
        return part

    def _freeze(self) -> None:
        """Protect what all copies of a controller share."""
        shown = (self.joint_positions, self.durations, self.preconditions, self.outcomes)
        for array in shown:
            array.setflags(write=False)

    def positions_before(self) -> NDArray[np.float64]:
        """Objects' positions before each action, (n, n_objects, 3) metres; needs O."""
        return self._positions(self.preconditions)

    def positions_after(self) -> NDArray[np.float64]:
        """Objects' positions after each action, (n, n_objects, 3) metres; needs O."""
        return self._positions(self.outcomes)

    def orientations_before(self) -> NDArray[np.float64]:
        """Objects' quaternions (x, y, z, w) before each action, (n, n_objects, 4); needs O."""
        return self._visible_poses()[self.preconditions, :, 3:]

    def orientations_after(self) -> NDArray[np.float64]:
        """Objects' quaternions (x, y, z, w) after each action, (n, n_objects, 4); needs O."""
        return self._visible_poses()[self.outcomes, :, 3:]

    def image_before(self, index: int) -> NDArray[np.uint8]:
        """The image before an action, (height, width, 3) uint8; raises RecordingError."""
        return self._image(self.preconditions[index])

    def image_after(self, index: int) -> NDArray[np.uint8]:
        """The image after an action, (height, width, 3) uint8; raises RecordingError."""
        return self._image(self.outcomes[index])

    def map_images(self, function: Callable[[NDArray[np.uint8]], Any]) -> NDArray[Any]:
        """A function of the image of every state, without holding all images in memory.

        Args:
            function: from an image, (height, width, 3) uint8, to a number or an array.

        Returns:
            Its values by number of the state, in the order of their time, (n_states, ...): before
            each action ``values[experience.preconditions]``, after it
            ``values[experience.outcomes]``.
        """
        with Recording(self.path) as recording:
            values = np.empty(0)
            for first in range(0, self.n_states, IMAGES_PER_CHUNK):
                count = min(IMAGES_PER_CHUNK, self.n_states - first)
                for row, image in enumerate(
                    recording.images(self._first_state + first, count), first
                ):
                    value = np.asarray(function(image))
                    if row == 0:  # only now is the size known
                        values = np.empty((self.n_states, *value.shape), value.dtype)
                    values[row] = value
        return values

    def action(self, index: int) -> Action:
        """An action as it was executed, ready to be executed again."""
        first, count = int(self._first_commands[index]), int(self._n_commands[index])
        rows = self._commands[first : first + count]
        return Action.from_rows(rows)

    @cached_property
    def _commands(self) -> NDArray[Any]:
        with Recording(self.path) as recording:
            return recording.commands()

    def _positions(self, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        return self._visible_poses()[rows, :, :3]

    def _visible_poses(self) -> NDArray[np.float64]:
        if self._poses is None:
            raise RecordingError(
                "in image conditions an experience has no positions: use its images"
            )
        return self._poses

    @cached_property
    def _recording(self) -> Recording:
        """The recording, open for reading images one by one."""
        return Recording(self.path)

    def _image(self, row: int) -> NDArray[np.uint8]:
        image: NDArray[np.uint8] = self._recording.images(self._first_state + int(row), 1)[0]
        return image
