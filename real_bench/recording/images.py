"""The images of a recording, read in any order; packed data is checked before it is read."""

from __future__ import annotations

import h5py
import numpy as np
from numpy.typing import NDArray

from real_bench.recording.schema import IMAGES_PER_CHUNK
from real_bench.recording.validation import check_pieces


class ImageReader:
    """Reads images of states.

    Args:
        data: the dataset of images.
    """

    def __init__(self, data: h5py.Dataset) -> None:
        self._data = data
        self._rows = IMAGES_PER_CHUNK if data.chunks is None else int(data.chunks[0])
        self._checked: set[int] = set()
        self.shape: tuple[int, int, int] = data.shape[1:]

    def __len__(self) -> int:
        return len(self._data)

    def read(self, first: int, count: int | None) -> NDArray[np.uint8]:
        """Images of states, (count, height, width, 3) uint8; None: to the last.

        Raises:
            ValueError, OSError: the file is damaged.
        """
        end = len(self) if count is None else min(first + count, len(self))
        for piece in range(first // self._rows, -(-end // self._rows)):
            self._check(piece)
        images: NDArray[np.uint8] = self._data[first:end]
        return images

    def pair(self, before: int, after: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """The images of two states, each (height, width, 3) uint8; neighbours are read at once."""
        if after == before + 1:
            both = self.read(before, 2)
            return both[0], both[1]
        return self.read(before, 1)[0], self.read(after, 1)[0]

    def _check(self, piece: int) -> None:
        if piece not in self._checked:
            check_pieces(self._data, piece * self._rows, (piece + 1) * self._rows)
            self._checked.add(piece)
