"""Which thing is which: how many there are and what each looks like, learned from blobs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from real_bench.real_g.arrays import Array
from real_bench.real_g.blobs import N_COLOURS, Blob

ROUNDS = 20
"""Rounds of sorting blobs and learning looks; more change nothing."""

RARE_SHARE = 0.02
"""The share of a look that goes to colours never seen on it."""

MIN_SIZE_SHARE = 0.25
"""A blob smaller than this share of the usual size is noise."""


class Appearances:
    """Distinguishes things by their colours, in a fixed order of its own.

    It assumes as many things as the number of blobs seen most often; in the images with that many
    blobs it assigns blobs to things, one to one, so that they look alike.
    """

    def __init__(self) -> None:
        self._colours = np.zeros((0, N_COLOURS))
        self._sizes = np.zeros(0)

    def __len__(self) -> int:
        return len(self._colours)

    @property
    def likelihoods(self) -> Array:
        """How likely a pixel of each thing has each colour, (k, N_COLOURS), never 0."""
        return (1 - RARE_SHARE) * self._colours + RARE_SHARE / N_COLOURS

    def learn(self, images: Sequence[Sequence[Blob]]) -> None:
        """Learn again from the blobs of images; does nothing if there are none."""
        largest = [blobs[0].size for blobs in images if blobs]
        if not largest:
            return
        min_size = MIN_SIZE_SHARE * float(np.median(largest))
        kept = [[blob for blob in blobs if blob.size >= min_size] for blobs in images]
        counts = np.bincount([len(blobs) for blobs in kept if blobs])
        n = int(counts.argmax())
        whole = [blobs for blobs in kept if len(blobs) == n]
        colours = np.array([[blob.colours for blob in blobs] for blobs in whole])
        sizes = np.array([[blob.size for blob in blobs] for blobs in whole], np.float64)
        centres = self._colours if len(self) == n else colours[-1]
        order = np.zeros((0, n), np.intp)
        for _ in range(ROUNDS):
            before = order
            order = np.array([_assign(_costs(row, centres)) for row in colours])
            centres = np.take_along_axis(colours, order[:, :, None], 1).mean(axis=0)
            if np.array_equal(before, order):
                break
        if len(self) != n:  # independent of the first image: the redder, the earlier
            rank = np.lexsort(centres.T)
            centres, order = centres[rank], order[:, rank]
        self._colours = centres
        self._sizes = np.median(np.take_along_axis(sizes, order, 1), axis=0)

    def assign(self, blobs: Sequence[Blob]) -> list[Blob | None]:
        """The blob of each thing; None where too few are seen, or merged."""
        large = [
            blob for blob in blobs if blob.size >= MIN_SIZE_SHARE * self._sizes.min(initial=np.inf)
        ]
        found: list[Blob | None] = [None] * len(self)
        if large:
            costs = _costs(np.array([blob.colours for blob in large]), self.likelihoods)
            for thing, blob in zip(*scipy.optimize.linear_sum_assignment(costs.T), strict=True):
                found[int(thing)] = large[int(blob)]
        return found

    def is_whole(self, thing: int, blob: Blob) -> bool:
        """Whether a blob is large enough to be that thing."""
        return blob.size >= MIN_SIZE_SHARE * float(self._sizes[thing])

    def may_be_merged(self, blobs: Sequence[Blob]) -> bool:
        """Whether things may be merged: there are fewer blobs than things."""
        min_size = MIN_SIZE_SHARE * self._sizes.min(initial=np.inf)
        return bool(0 < sum(blob.size >= min_size for blob in blobs) < len(self))

    def get_state(self) -> dict[str, Any]:
        """What things look like, as arrays."""
        return {"colours": self._colours, "sizes": self._sizes}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with these looks."""
        self._colours = np.asarray(state["colours"], np.float64)
        self._sizes = np.asarray(state["sizes"], np.float64)


def _costs(colours: Array, appearances: Array) -> Array:
    """How little each of n colourings is like each of k looks, (n, k)."""
    likely = (1 - RARE_SHARE) * appearances + RARE_SHARE / N_COLOURS
    return -np.asarray(colours @ np.log(likely).T)


def _assign(costs: Array) -> NDArray[np.intp]:
    """For each look the row that it fits, one to one."""
    rows, columns = scipy.optimize.linear_sum_assignment(costs)
    order = np.empty(len(rows), np.intp)
    order[columns] = rows
    return order
