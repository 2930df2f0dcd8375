"""What can be moved: everything that differs from the background, learned from a run's images.

The background is the median of images that differ much from each other: if things lay at many
different places, each place was empty most of the time. How much each pixel flickers by itself is
learned from the same images.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from real_bench.errors import RealBenchError
from real_bench.real_g.arrays import Image

MAX_KEPT = 64
"""Number of images whose median is the background."""

COMPARISON_SIZE = (80, 60)
"""Width and height at which images are compared to decide which are kept."""

NOISE_LEVEL = 12
"""A smaller difference in each colour, in grey levels, is ignored as camera noise."""


class Foreground:
    """Tells what can be moved from what stays.

    An image is kept if it differs from every kept one by at least half as many pixels as two of
    them usually do. If there are too many, all that were ever worth keeping have the same chance to
    be kept. So a thing is background until it is moved for the first time.

    Args:
        random: for which images are kept.

    Attributes:
        change: how much the last image differed from the previous one; 1 is the usual difference of
            two images with things at different places.
    """

    def __init__(self, random: np.random.Generator) -> None:
        self._random = random
        self._kept: list[Image] = []
        self._small: list[Image] = []
        self._last: Image | None = None
        self._n_candidates = 0
        self._typical_change = 0.0
        self.change = 0.0
        self._background: Image | None = None
        self._flicker: NDArray[np.int16] | None = None

    def __deepcopy__(self, memo: object) -> Foreground:
        twin = copy.copy(self)  # images are never written to, so copies may share them
        twin._kept, twin._small = list(self._kept), list(self._small)
        twin._random = copy.deepcopy(self._random)
        return twin

    @property
    def is_known(self) -> bool:
        """Whether a background has been learned."""
        return self._background is not None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the background; raises RealBenchError."""
        height, width = self._learned()[0].shape[:2]
        return width, height

    def add(self, image: Image) -> bool:
        """Look at the next image, (height, width, 3); returns whether anything has changed."""
        small = _shrunk(image)
        n_changed = 0 if self._last is None else _n_changed(small, self._last)
        self.change = n_changed / max(self._typical_change, 1.0)
        if self._last is not None and n_changed == 0:
            return False
        self._last = small
        distances = [_n_changed(small, other) for other in self._small]
        if not distances or min(distances) > self._typical_change / 2:
            nth = len(distances) + 1
            self._typical_change += (
                float(np.median(distances or [0])) - self._typical_change
            ) / nth
            self._keep(image, small)
        return True

    def learn(self) -> bool:
        """Learn the background again; returns whether it has changed."""
        kept = np.array(self._kept)
        middle = len(kept) // 2
        background = np.partition(kept, middle, axis=0)[middle]
        differences = np.array([_max_difference(image, background) for image in self._kept])
        typical = np.partition(differences, middle, axis=0)[middle]
        before, self._background = self._background, background
        self._flicker = np.maximum(2 * typical.astype(np.int16), NOISE_LEVEL)
        return before is None or _n_changed(before, background) > 0

    def mask(self, image: Image) -> NDArray[np.bool_]:
        """Which pixels show what can be moved, (height, width); raises RealBenchError."""
        background, flicker = self._learned()
        return np.asarray(_max_difference(image, background) > flicker)

    def _learned(self) -> tuple[Image, NDArray[np.int16]]:
        if self._background is None or self._flicker is None:
            raise RealBenchError("no background has been learned yet")
        return self._background, self._flicker

    def _keep(self, image: Image, small: Image) -> None:
        self._n_candidates += 1
        if len(self._kept) < MAX_KEPT:
            self._kept.append(image.copy())
            self._small.append(small)
            return
        slot = int(self._random.integers(self._n_candidates))
        if slot < MAX_KEPT:
            self._kept[slot], self._small[slot] = image.copy(), small

    def get_state(self) -> dict[str, Any]:
        """The background and how much it flickers, as arrays."""
        if self._background is None or self._flicker is None:
            return {}
        return {"background": self._background, "flicker": self._flicker}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Know this background, with no image kept."""
        if state:
            self._background = np.asarray(state["background"], np.uint8)
            self._flicker = np.asarray(state["flicker"], np.int16)


def _shrunk(image: Image) -> Image:
    return np.asarray(cv2.resize(image, COMPARISON_SIZE, interpolation=cv2.INTER_AREA), np.uint8)


def _n_changed(one: Image, other: Image) -> int:
    return int(np.count_nonzero(_max_difference(one, other) > NOISE_LEVEL))


def _max_difference(one: Image, other: Image) -> NDArray[np.uint8]:
    """The largest difference of the three colours, (height, width)."""
    red, green, blue = cv2.split(cv2.absdiff(one, other))
    return np.asarray(cv2.max(cv2.max(red, green), blue), np.uint8)
