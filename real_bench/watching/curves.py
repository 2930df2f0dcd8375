"""Curves made of characters, for a terminal."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

BLOCKS = " ▁▂▃▄▅▆▇█"
ASCII = " .:-=+*#@"


def bin_means(steps: ArrayLike, values: ArrayLike, end: int, n_bins: int) -> NDArray[np.float64]:
    """The mean of the finite values in equal parts of the steps up to ``end``, (n_bins,).

    NaN where there is none.
    """
    at, given = np.asarray(steps, np.float64), np.asarray(values, np.float64)
    bins = np.clip((at * n_bins / max(end, 1)).astype(np.int64), 0, n_bins - 1)
    is_finite = np.isfinite(given)
    sums = np.bincount(bins[is_finite], given[is_finite], n_bins)
    counts = np.bincount(bins[is_finite], minlength=n_bins)
    means = np.full(n_bins, np.nan)
    np.divide(sums, counts, out=means, where=counts > 0)
    return means


def curve(
    values: NDArray[np.float64], height: int, low: float, high: float, letters: str = BLOCKS
) -> list[str]:
    """Lines of characters, the highest first; one column per value, blank for NaN.

    Args:
        values: (n,).
        height: number of lines.
        low: the value of the lowest line.
        high: the value of the highest line.
        letters: from nothing to a full cell.
    """
    full = len(letters) - 1
    extent = high / 2 - low / 2  # halves, since the whole may be beyond all numbers
    part = np.clip((values / 2 - low / 2) / extent if extent > 0 else values * 0 + 0.5, 0, 1)
    filled = np.where(np.isnan(part), 0, 1 + np.round(np.nan_to_num(part) * (height * full - 1)))
    return [
        "".join(letters[int(np.clip(count - full * line, 0, full))] for count in filled)
        for line in reversed(range(height))
    ]
