"""Background subtraction, learned from a run's own images (paper, section REAL-LD)."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from real_bench.errors import RealBenchError

Image = NDArray[np.uint8]


class Background:
    """The parts that change little from image to image, found by OpenCV's MOG2.

    Args:
        images: (n, height, width, 3) uint8, at least two, in the order of their time.
    """

    def __init__(self, images: Sequence[Image] | Image) -> None:
        if len(images) < 2:
            raise RealBenchError(
                f"learning a background needs at least 2 images, not {len(images)}"
            )
        self._model = cv2.createBackgroundSubtractorMOG2(history=len(images))
        for image in images:
            self._model.apply(image)

    def __deepcopy__(self, memo: object) -> Background:
        return self  # it never changes

    def foreground(self, image: Image) -> NDArray[np.float32]:
        """What is not background in an image, (height, width): 1 where it is not, else 0."""
        mask = self._model.apply(image, learningRate=0)  # a shadow is marked, too
        return np.asarray(mask > 0, np.float32)
