"""A recording as a torch dataset: random access for a shuffled ``DataLoader``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch.utils.data import Dataset

from real_bench.recording.arrays import MOMENTS, Size, images_of

if TYPE_CHECKING:
    from real_bench.recording.reader import Recording

Sample = dict[str, torch.Tensor]


class TripletDataset(Dataset[Sample]):
    """The triplets of a recording as tensors, with the names of ``Recording.to_numpy``.

    Numbers are float32, steps int64, images uint8 (3, height, width). Each process that reads
    full-size images opens the file itself, so the dataset may be passed to workers.

    Args:
        recording: what to read; it may be closed afterwards.
        image_size: width and height to which images are shrunk, all at once and in memory;
            None: as recorded, each read from the file on demand.
        cache: a folder in which the shrunk images are kept, so that they are made only once.

    Raises:
        RecordingError: images are asked for, but there are none.
    """

    def __init__(
        self, recording: Recording, image_size: Size | None = None, cache: Path | None = None
    ) -> None:
        rows = recording.transitions
        self._table = {
            name: torch.from_numpy(_single(values)) for name, values in recording.to_numpy().items()
        }
        self._states = {moment: rows[column].copy() for moment, column in MOMENTS.items()}
        self._open, self._path = type(recording), recording.path.resolve()
        self._has_images = recording.n_images is not None or image_size is not None
        kept = cache is not None or image_size is not None
        self._images = images_of(recording, image_size, cache) if kept else None
        self._opened: tuple[int, Recording] | None = None

    def __len__(self) -> int:
        return len(self._states["before"])

    def __getitem__(self, index: int) -> Sample:
        """One triplet; raises IndexError beyond the last."""
        index = range(len(self))[index]
        sample = {name: values[index] for name, values in self._table.items()}
        if self._has_images:
            before, after = (int(self._states[moment][index]) for moment in MOMENTS)
            for moment, image in zip(MOMENTS, self._pair(before, after), strict=True):
                sample[f"image_{moment}"] = torch.from_numpy(
                    np.ascontiguousarray(image.transpose(2, 0, 1))
                )
        return sample

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_opened": None}

    def _pair(self, before: int, after: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        if self._images is not None:
            return np.array(self._images[before]), np.array(self._images[after])
        return self._recording().image_pair(before, after)

    def _recording(self) -> Recording:
        """The file, open in this process."""
        process = os.getpid()
        if self._opened is None or self._opened[0] != process:
            self._opened = process, self._open(self._path)
        return self._opened[1]


def _single(values: NDArray[Any]) -> NDArray[Any]:
    return values.astype(np.float32) if values.dtype.kind == "f" else values
