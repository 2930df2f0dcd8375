"""A recording as plain arrays for training: one row per triplet."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import RecordingError
from real_bench.files.atomic import atomic_replacement
from real_bench.files.outputs import check_folder
from real_bench.recording.schema import IMAGES_PER_CHUNK

if TYPE_CHECKING:
    from real_bench.recording.reader import Recording

Size = tuple[int, int]
"""Width and height, in pixels."""

MOMENTS = {"before": "precondition", "after": "outcome"}


def table_of(recording: Recording) -> dict[str, NDArray[Any]]:
    """All but the images; see ``Recording.to_numpy``."""
    rows, states = recording.transitions, recording.states
    known = {name: states[name] for name in ("joint_positions", "touch_sensors")}
    if recording.has_poses:
        known["object_poses"] = recording.object_poses
    table = {
        f"{name}_{moment}": values[rows[column]]
        for name, values in known.items()
        for moment, column in MOMENTS.items()
    }
    return {**table, **_actions_of(recording)}


def _actions_of(recording: Recording) -> dict[str, NDArray[Any]]:
    """Commands, padded to the longest action by zeros that last 0 steps."""
    counts, given = recording.transitions["n_commands"], recording.commands()
    filled = np.arange(counts.max(initial=0)) < counts[:, None]
    actions = {}
    for name, values in (
        ("commands", given["command"]),
        ("n_steps", given["n_steps"]),
        ("line", given["line"].astype(bool)),
    ):
        padded = np.zeros((*filled.shape, *values.shape[1:]), values.dtype)
        padded[filled] = values
        actions[name] = padded
    return actions


def images_of(recording: Recording, size: Size | None, cache: Path | None) -> NDArray[np.uint8]:
    """The images of all states, (m, height, width, 3) uint8, shrunk if a size is given.

    Args:
        recording: with images.
        size: of the images; None: as recorded.
        cache: a folder to keep them in; if they are there already, they are read from it page by
            page.

    Raises:
        RecordingError: there are none, or the size is invalid.
        OutputError: they cannot be written.
    """
    if size is not None and not _is_size(size):
        raise RecordingError(f"an image size is (width, height) in pixels, not {size!r}")
    if cache is None:
        return _joined(_pieces(recording, size), recording.n_states, _shape(recording, size))
    path = cache / f"images-{_fingerprint(recording)}-{'x'.join(map(str, size or ('full',)))}.npy"
    if not path.exists():
        check_folder(cache, make=True)
        shape = (recording.n_states, *_shape(recording, size))
        with atomic_replacement(path) as hidden:
            kept = np.lib.format.open_memmap(hidden, "w+", np.uint8, shape)
            _fill(kept, _pieces(recording, size))
            kept.flush()
    kept_images: NDArray[np.uint8] = np.load(path, mmap_mode="r")
    return kept_images


def _is_size(size: object) -> bool:
    if not isinstance(size, list | tuple):
        return False
    return len(size) == 2 and all(isinstance(each, Integral) and int(each) >= 1 for each in size)


def _shape(recording: Recording, size: Size | None) -> tuple[int, int, int]:
    if size is not None:
        return (size[1], size[0], 3)
    height, width, depth = recording.image_shape
    return (height, width, depth)


def _pieces(recording: Recording, size: Size | None) -> Iterator[NDArray[np.uint8]]:
    """The images in order, some at a time."""
    for first in range(0, recording.n_states, IMAGES_PER_CHUNK):
        count = min(IMAGES_PER_CHUNK, recording.n_states - first)
        yield resize_images(recording.images(first, count), size)


def resize_images(images: NDArray[np.uint8], size: Size | None) -> NDArray[np.uint8]:
    """Resize images, (count, height, width, 3) uint8; None: leave them."""
    if size is None:
        return images
    import cv2

    return np.stack([cv2.resize(image, size, interpolation=cv2.INTER_AREA) for image in images])


def _joined(
    pieces: Iterator[NDArray[np.uint8]], count: int, shape: tuple[int, int, int]
) -> NDArray[np.uint8]:
    images = np.empty((count, *shape), np.uint8)
    _fill(images, pieces)
    return images


def _fill(images: NDArray[np.uint8], pieces: Iterator[NDArray[np.uint8]]) -> None:
    first = 0
    for piece in pieces:
        images[first : first + len(piece)] = piece
        first += len(piece)


def _fingerprint(recording: Recording) -> str:
    """A hash of what was recorded, so that cached images cannot belong to something else."""
    digest = hashlib.sha256(recording.header.scene_sha256.encode())
    digest.update(recording.states.tobytes())
    if recording.has_poses:
        digest.update(recording.object_poses.tobytes())
    return digest.hexdigest()[:16]
