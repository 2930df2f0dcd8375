"""States of latent variables: what an eye sees, through a VAE (paper, section REAL-LD)."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from real_bench.errors import RealBenchError
from real_bench.real_x.foreground import ForegroundExtractor, ForegroundSettings
from real_bench.real_x.perception import StateVector
from real_bench.real_x.triplets import Triplets
from real_bench.real_x.vae import VAE, OnTraining, Training
from real_bench.recording import Experience
from real_bench.settings import Settings
from real_bench.text.counting import counted

LATENTS_PER_OBJECT = 7
"""Latent variables per object, as in the paper."""

MIN_DIVERGENCE = 0.1
"""A latent variable is in use if it diverges this much from the prior, in nats."""

PAPER_PIXELS = 320 * 240

LINES_PER_TRAINING = 15

log = logging.getLogger(__name__)


class VAESettings(Settings):
    """Size and training of the VAE.

    With the paper's weights of reconstruction and prior, codes of distant places are crowded into
    the prior's unit ball, and folded after long training. With a heavier reconstruction they keep
    their distances, and a few epochs are enough.

    Attributes:
        hidden: units of each hidden layer; the paper's are 512.
        steps: of training, however few images there are; the last epoch is completed. The paper's
            30 epochs are 3,540.
        batch: images in a step; the paper's are 128.
        rate: of learning with Adam; the paper's is, we assume, 0.001.
        weight: of reconstruction relative to the prior, 1 in the paper; a cell counts as many of
            the paper's pixels as it covers.
    """

    hidden: int = Field(default=128, ge=1, le=100_000)
    steps: int = Field(default=800, ge=1)
    batch: int = Field(default=128, ge=1)
    rate: float = Field(default=3e-3, gt=0)
    weight: float = Field(default=1000.0, gt=0)


class SightSettings(Settings):
    """How images are seen, part by part."""

    eye: ForegroundSettings = ForegroundSettings()
    vae: VAESettings = VAESettings()


class Latents:
    """Encodes images with a background and a VAE, both learned from experience.

    Args:
        eye, vae: settings.

    Attributes:
        divergences: how much each latent variable says, (n_latent,) nats
            (:meth:`~real_bench.real_x.vae.VAE.divergences`); empty until it learns.
    """

    def __init__(self, eye: ForegroundSettings, vae: VAESettings) -> None:
        self._eye_settings, self._vae_settings, self._seed = eye, vae, 0
        self._eye = ForegroundExtractor(eye)
        self._vae: VAE | None = None
        self._learned_from = 0
        self.divergences: NDArray[np.float64] = np.empty(0)

    def seed(self, seed: int) -> None:
        """Seed the VAE's initial weights and training."""
        self._seed = seed

    def state(self, observation: Mapping[str, Any]) -> StateVector:
        """The code of the camera's image now."""
        return self.code(self.shrink(observation["retina"]))

    def goal(self, observation: Mapping[str, Any]) -> StateVector:
        """The code of the goal's image."""
        return self.code(self.shrink(observation["goal"]))

    def positions(self, states: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """None: codes hold no positions."""
        return None

    def triplets(self, experience: Experience) -> Triplets:
        """The codes before and after each action; learns to encode first if needed.

        What was learned from less experience, before play continued, is learned again.
        """
        images = experience.map_images(self.shrink)
        if self._vae is None or self._learned_from != len(images):
            n_latent = LATENTS_PER_OBJECT * len(experience.object_names)
            codes = self.learn(images, n_latent, _log_epoch)
        else:
            self._eye.learn_background(images)
            codes = self._encode(self._eye.foregrounds(images))
        return Triplets(codes[experience.preconditions], codes[experience.outcomes])

    def learn(
        self, images: NDArray[np.uint8], n_latent: int, report: OnTraining | None = None
    ) -> NDArray[np.float64]:
        """Learn from images in the eye's size; what was learned before is forgotten.

        Args:
            images: (n, height, width, 3) in the order of their time.
            n_latent: variables of a code.
            report: called with each epoch, their number, and the mean loss.

        Returns:
            Their codes, (n, n_latent).
        """
        self._eye.learn_background(images)
        foregrounds = self._eye.foregrounds(images)
        vae, settings = self._new_vae(n_latent), self._vae_settings
        weight = settings.weight * PAPER_PIXELS / vae.n_inputs
        epochs = math.ceil(settings.steps / math.ceil(len(images) / settings.batch))
        training = Training(epochs, settings.batch, settings.rate, weight)
        vae.train(foregrounds, training, report or _ignore_epoch)
        self._vae, self._learned_from = vae, len(images)
        self.divergences = vae.divergences(foregrounds)
        n_used = int((self.divergences > MIN_DIVERGENCE).sum())
        log.info("VAE: %d of %s in use", n_used, counted(n_latent, "variable"))
        return self._encode(foregrounds)

    def shrink(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """An image in the eye's size, (height, width, 3)."""
        return self._eye.shrink(image)

    def code(self, image: NDArray[np.uint8]) -> StateVector:
        """The code of one image in the eye's size; raises RealBenchError untrained."""
        code: StateVector = self._encode(self._eye.foregrounds(image[None]))[0]
        return code

    def get_state(self) -> dict[str, Any]:
        """What the VAE has learned; the background is learned again from the run's images."""
        learned = {} if self._vae is None else self._vae.weights()
        return {
            "seed": self._seed,
            "settings": self._settings(),
            "vae": learned,
            "learned_from": self._learned_from,
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Use what was learned before, unless it was learned with other settings."""
        self._seed = state["seed"]
        weights = state["vae"]
        if weights and state["settings"] == self._settings():
            self._vae = self._new_vae(len(weights["mean.bias"]))
            self._vae.set_weights(weights)
            self._learned_from = state["learned_from"]

    def _encode(self, foregrounds: NDArray[np.float32]) -> NDArray[np.float64]:
        if self._vae is None:
            raise RealBenchError("the VAE is not trained yet")
        return self._vae.encode(foregrounds)

    def _settings(self) -> dict[str, Any]:
        return {"eye": self._eye_settings.model_dump(), "vae": self._vae_settings.model_dump()}

    def _new_vae(self, n_latent: int) -> VAE:
        width, height = self._eye_settings.cells
        return VAE(width * height, n_latent, self._vae_settings.hidden, self._seed)


def _log_epoch(epoch: int, n_epochs: int, loss: float) -> None:
    if (epoch + 1) % math.ceil(n_epochs / LINES_PER_TRAINING) == 0 or epoch + 1 == n_epochs:
        log.info("VAE: epoch %d of %d, loss %.1f", epoch + 1, n_epochs, loss)


def _ignore_epoch(epoch: int, n_epochs: int, loss: float) -> None:
    pass
