"""States of latent variables: background subtraction, then a VAE (paper, section REAL-LD)."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.ndimage import gaussian_filter

from real_bench.errors import RealBenchError
from real_bench.real_x.background import Background
from real_bench.real_x.perception import State
from real_bench.real_x.triplets import Triplets
from real_bench.real_x.vae import VAE, Training
from real_bench.recording import Experience
from real_bench.settings import Settings

LATENT_AN_OBJECT = 7
"""Latent variables an object, as in the paper."""

PAPER_PIXELS = 320 * 240

log = logging.getLogger(__name__)


class EyeSettings(Settings):
    """What a VAE is shown of the foreground.

    Attributes:
        width, height: of the images, in cells; the paper's are 320 x 240.
        blur: standard deviation of the Gaussian that smooths the foreground, in cells; 0 for none.
            Smoothed, two positions of an object overlap, and the nearer they are the more.
    """

    width: int = Field(80, ge=8, le=320)
    height: int = Field(60, ge=6, le=240)
    blur: float = Field(4.0, ge=0, le=40)


class VAESettings(Settings):
    """How the VAE is made and trained; see :class:`real_bench.real_x.vae.Training`.

    The paper's were 30 epochs. Without a ``weight``, a cell weighs as many of the paper's pixels as
    it covers.
    """

    hidden: int = Field(512, ge=1, le=100_000)
    epochs: int = Field(10, ge=1)
    batch: int = Field(128, ge=1)
    rate: float = Field(1e-3, gt=0)
    weight: float | None = Field(None, gt=0)


class Latents:
    """Sees images through a background and a VAE that both are learned from experience.

    Args:
        eye, vae: settings.
    """

    def __init__(self, eye: EyeSettings, vae: VAESettings) -> None:
        self._eye, self._vae_settings, self._seed = eye, vae, 0
        self._background: Background | None = None
        self._vae: VAE | None = None
        self._learned_from = 0

    def seed(self, seed: int) -> None:
        """Of the VAE's first weights and training."""
        self._seed = seed

    def state(self, observation: Mapping[str, Any]) -> State:
        """The code of the camera's image now."""
        return self._code(observation["retina"])

    def goal(self, observation: Mapping[str, Any]) -> State:
        """The code of the goal's image."""
        return self._code(observation["goal"])

    def positions(self, states: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Codes tell no positions."""
        return None

    def triplets(self, experience: Experience) -> Triplets:
        """The codes before and after each action, learned first where they are not yet.

        What was learned from less, before play went on, is learned anew.
        """
        images = experience.map_images(self.shrink)
        self._background = Background(images)
        foregrounds = self.foregrounds(images)
        if self._vae is None or self._learned_from != len(images):
            self._vae = self._made(LATENT_AN_OBJECT * len(experience.object_names))
            self._learned_from = len(images)
            self._train(self._vae, foregrounds)
        codes = self.encode(foregrounds)
        return Triplets(codes[experience.preconditions], codes[experience.outcomes])

    def shrink(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """An image in the eye's size, (height, width, 3)."""
        size = (self._eye.width, self._eye.height)
        return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)

    def foregrounds(self, images: NDArray[np.uint8]) -> NDArray[np.float32]:
        """What the VAE is shown of (n, height, width, 3) images in the eye's size: (n, cells)."""
        found = np.empty((len(images), self._eye.width * self._eye.height), np.float32)
        for row, image in zip(found, images, strict=True):
            row[:] = self._foreground(image)
        return found

    def encode(self, foregrounds: NDArray[np.float32]) -> NDArray[np.float64]:
        """The codes of foregrounds, (n, cells) to (n, V); raises RealBenchError untrained."""
        if self._vae is None:
            raise RealBenchError("the VAE has learned nothing yet")
        return self._vae.encode(foregrounds)

    def get_state(self) -> dict[str, Any]:
        """What the VAE has learned; the background is learned anew from the run's images."""
        learned = {} if self._vae is None else self._vae.weights()
        return {
            "seed": self._seed,
            "settings": self._settings(),
            "vae": learned,
            "learned_from": self._learned_from,
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with what was learned before, unless it was learned with other settings."""
        self._seed = state["seed"]
        weights = state["vae"]
        if weights and state["settings"] == self._settings():
            self._vae = self._made(len(weights["mean.bias"]))
            self._vae.set_weights(weights)
            self._learned_from = state["learned_from"]

    def _code(self, image: NDArray[np.uint8]) -> State:
        code: State = self.encode(self.foregrounds(self.shrink(image)[None]))[0]
        return code

    def _foreground(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        if self._background is None:
            raise RealBenchError("no background has been learned yet")
        marked = self._background.foreground(image)
        if self._eye.blur > 0:
            marked = gaussian_filter(marked, self._eye.blur, mode="constant")
        return np.ravel(marked)

    def _settings(self) -> dict[str, Any]:
        return {"eye": self._eye.model_dump(), "vae": self._vae_settings.model_dump()}

    def _made(self, n_latent: int) -> VAE:
        n_inputs = self._eye.width * self._eye.height
        return VAE(n_inputs, n_latent, self._vae_settings.hidden, self._seed)

    def _train(self, vae: VAE, foregrounds: NDArray[np.float32]) -> None:
        settings = self._vae_settings
        weight = settings.weight or PAPER_PIXELS / vae.n_inputs
        training = Training(settings.epochs, settings.batch, settings.rate, weight)

        def report(epoch: int, loss: float) -> None:
            log.info("VAE: epoch %d of %d, loss %.1f", epoch + 1, settings.epochs, loss)

        vae.train(foregrounds, training, report)
