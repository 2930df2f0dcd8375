"""From camera images to what the VAE is shown of them (paper, section REAL-LD)."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from real_bench.errors import RealBenchError
from real_bench.real_x.background import Background
from real_bench.settings import Settings


class ForegroundSettings(Settings):
    """What a VAE is shown of the foreground.

    Attributes:
        width, height: of the images in which the background is found; the paper's are 320 x 240.
            What is finer than their pixels is lost to planning.
        shrink: a cell of what the VAE is shown is this many of their pixels wide and high.
        blur: standard deviation of the Gaussian that smooths the foreground, in cells; 0 for none.
            Smoothed, two positions of an object overlap, and the nearer they are the more.
    """

    width: int = Field(default=160, ge=8, le=320)
    height: int = Field(default=120, ge=6, le=240)
    shrink: int = Field(default=4, ge=1, le=40)
    blur: float = Field(default=2.0, ge=0, le=40)

    @model_validator(mode="after")
    def _cells_are_whole(self) -> ForegroundSettings:
        if self.width % self.shrink or self.height % self.shrink:
            raise ValueError(f"{self.width} x {self.height} cannot be shrunk by {self.shrink}")
        return self

    @property
    def cells(self) -> tuple[int, int]:
        """Width and height of what the VAE is shown."""
        return self.width // self.shrink, self.height // self.shrink


class ForegroundExtractor:
    """Tells what moves from what stays, once it has seen enough.

    Args:
        settings: how sharply it sees.
    """

    def __init__(self, settings: ForegroundSettings) -> None:
        self._settings = settings
        self._background: Background | None = None

    def shrink(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """An image in the eye's size, (height, width, 3)."""
        size = (self._settings.width, self._settings.height)
        return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)

    def learn_background(self, images: NDArray[np.uint8]) -> None:
        """From (n, height, width, 3) images in the eye's size, in the order of their time."""
        self._background = Background(images)

    def foregrounds(self, images: NDArray[np.uint8]) -> NDArray[np.float32]:
        """What a VAE is shown of (n, height, width, 3) images in the eye's size: (n, cells).

        Raises:
            RealBenchError: no background has been learned.
        """
        width, height = self._settings.cells
        found = np.empty((len(images), width * height), np.float32)
        for row, image in zip(found, images, strict=True):
            row[:] = self._foreground(image)
        return found

    def _foreground(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        if self._background is None:
            raise RealBenchError("no background has been learned yet")
        mask = self._background.foreground(image)
        cells = cv2.resize(mask, self._settings.cells, interpolation=cv2.INTER_AREA)
        if self._settings.blur > 0:
            blur, beyond = self._settings.blur, cv2.BORDER_CONSTANT
            cells = cv2.GaussianBlur(cells, (0, 0), blur, borderType=beyond)
        return np.ravel(np.asarray(cells, np.float32))
