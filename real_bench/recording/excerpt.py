"""What a controller may read of a recording, as a file of its own."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from real_bench.errors import RecordingError
from real_bench.recording.experience import Experience
from real_bench.recording.opening import open_hdf5
from real_bench.recording.reader import Recording
from real_bench.recording.schema import IMAGES_PER_CHUNK, POSES, packing

IMAGES_AT_ONCE = 16 * IMAGES_PER_CHUNK


def write_excerpt(experience: Experience, path: Path) -> None:
    """Write the recording behind an experience, without anything that the experience hides.

    It has no controller's state, and no ground truth if positions must not be seen.

    Raises:
        RecordingError: the recording cannot be read, or the excerpt cannot be written.
    """
    with Recording(experience.path) as recording:
        try:
            with open_hdf5(path, "w", libver="latest") as file:
                _write(experience, recording, file)
        except OSError as error:
            raise RecordingError(f"cannot write {path}: {error}") from error


def _write(experience: Experience, recording: Recording, file: h5py.File) -> None:
    source, n_states = recording.file, experience.n_states
    rows = recording.transitions[: len(experience)]
    for name, value in source.attrs.items():
        file.attrs[name] = value
    file.attrs["n_steps"] = int(rows["n_steps"].sum())
    file.create_group("controller_state")
    n_commands = int(rows["n_commands"].sum())
    counts = {"transitions": len(rows), "commands": n_commands, "states": n_states, "cuts": 0}
    file.attrs["excerpt"] = not experience.sees_objects
    if experience.sees_objects:
        counts[POSES] = n_states
    if recording.n_images is not None:
        counts["images"] = n_states
    for name, count in counts.items():
        _copy(source[name], file, name, count)


def _copy(source: h5py.Dataset, file: h5py.File, name: str, count: int) -> None:
    """Copy the first rows of a dataset, without recompressing if all are wanted."""
    if count == len(source):
        file.require_group(name.rpartition("/")[0] or "/")
        source.parent.copy(source, file, name)
        return
    shape, how = (count, *source.shape[1:]), packing(name)
    most = (None, *shape[1:])  # otherwise a chunk must not be longer than the rows
    target = file.create_dataset(
        name, shape, source.dtype, maxshape=most, chunks=source.chunks, **how
    )
    for first in range(0, count, IMAGES_AT_ONCE):
        last = min(first + IMAGES_AT_ONCE, count)
        target[first:last] = np.asarray(source[first:last])
