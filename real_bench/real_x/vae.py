"""The Variational Autoencoder that turns images into a few variables (paper, section REAL-LD)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn
from torch.nn import functional

from real_bench.errors import RealBenchError
from real_bench.real_x.threads import fixed_threads

MIN_CELL = 1e-5
"""Expected cell values are kept this far from 0 and 1."""
MAX_LOG_VARIANCE = 20.0
"""Of a code. A few images unlike all others, as of an arm in view, would make it overflow."""

Weights = dict[str, NDArray[np.float32]]
OnTraining = Callable[[int, int, float], None]
"""Called with an epoch (from 0), their number, and the mean loss."""


@dataclass(frozen=True)
class Training:
    """How a VAE is trained.

    Attributes:
        epochs: how often every image is seen.
        batch: images per step of Adam.
        rate: Adam's learning rate.
        weight: of each input's reconstruction relative to the prior.
    """

    epochs: int
    batch: int
    rate: float
    weight: float


class VAE:
    """One hidden layer each way, as in the paper; inputs are images with values from 0 to 1.

    The same seed, images and device give the same weights, bit for bit; therefore it always
    computes with the same number of threads.

    Args:
        n_inputs: cells of an image.
        n_latent: latent variables.
        n_hidden: units of the hidden layers.
        seed: of the initial weights and of all draws in training.
    """

    def __init__(self, n_inputs: int, n_latent: int, n_hidden: int, seed: int) -> None:
        self.n_inputs, self.n_latent = n_inputs, n_latent
        self._device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self._seed = seed
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self._network = _Network(n_inputs, n_latent, n_hidden).to(self._device)

    def __deepcopy__(self, memo: object) -> VAE:
        return self  # a trained one is only read

    @fixed_threads
    def train(self, images: NDArray[np.float32], training: Training, report: OnTraining) -> None:
        """Learn to reconstruct images, (n, n_inputs)."""
        if images.ndim != 2 or images.shape[1] != self.n_inputs or len(images) == 0:
            raise RealBenchError(
                f"a VAE of {self.n_inputs} inputs cannot learn from images {images.shape}"
            )
        random = torch.Generator().manual_seed(self._seed)
        noise = torch.Generator(self._device).manual_seed(self._seed)
        optimizer = torch.optim.Adam(self._network.parameters(), lr=training.rate)
        data = torch.from_numpy(images)
        self._network.begin_at(data)
        for epoch in range(training.epochs):
            total = 0.0
            order = torch.randperm(len(data), generator=random)
            for rows in torch.split(order, training.batch):
                batch = data[rows].to(self._device)
                loss = self._network.loss(batch, training.weight, noise)
                optimizer.zero_grad()
                loss.backward()  # type: ignore[no-untyped-call]
                optimizer.step()
                total += float(loss.detach()) * len(batch)
            if not math.isfinite(total):
                raise RealBenchError(f"the VAE diverged in epoch {epoch + 1}: lower its rate")
            report(epoch, training.epochs, total / len(data))

    @fixed_threads
    def encode(self, images: NDArray[np.float32]) -> NDArray[np.float64]:
        """The means of the latent variables of images, (n, n_inputs) to (n, n_latent)."""
        return np.asarray(self._encoded(images)[0].numpy(), np.float64)

    @fixed_threads
    def divergences(self, images: NDArray[np.float32]) -> NDArray[np.float64]:
        """How much each latent variable says of images, (n, n_inputs) to (n_latent,) nats.

        The mean over the images of its divergence (KL) from the prior: near 0 for a variable that
        says nothing.
        """
        found = _divergence(*self._encoded(images))
        return np.asarray(found.mean(dim=0).numpy(), np.float64)

    def _encoded(self, images: NDArray[np.float32]) -> tuple[torch.Tensor, torch.Tensor]:
        """Means and log variances of the latent variables, (n, n_latent) each."""
        with torch.no_grad():
            parts = [
                self._network.encode(part.to(self._device))
                for part in torch.split(torch.from_numpy(np.ascontiguousarray(images)), 1024)
            ]
        means, log_variances = zip(*parts, strict=True)
        return torch.cat(means).cpu(), torch.cat(log_variances).cpu()

    def weights(self) -> Weights:
        """What it has learned, as arrays."""
        return {
            name: values.cpu().numpy().copy() for name, values in self._network.state_dict().items()
        }

    def set_weights(self, weights: Mapping[str, NDArray[np.float32]]) -> None:
        """Load the weights of another VAE; raises RealBenchError if they do not fit."""
        tensors = {name: torch.from_numpy(np.array(values)) for name, values in weights.items()}
        try:
            self._network.load_state_dict(tensors)
        except RuntimeError as error:
            raise RealBenchError(f"these weights are of another VAE: {error}") from error


class _Network(nn.Module):
    mean_image: torch.Tensor
    scale: torch.Tensor

    def __init__(self, n_inputs: int, n_latent: int, n_hidden: int) -> None:
        super().__init__()
        self.inward = nn.Linear(n_inputs, n_hidden)
        self.mean = nn.Linear(n_hidden, n_latent)
        self.log_variance = nn.Linear(n_hidden, n_latent)
        self.outward = nn.Linear(n_latent, n_hidden)
        self.image = nn.Linear(n_hidden, n_inputs)
        self.register_buffer("mean_image", torch.zeros(n_inputs))
        self.register_buffer("scale", torch.ones(()))

    def begin_at(self, images: torch.Tensor) -> None:
        """Start from the images' mean: encode deviations from it, and decode to it at first.

        So the first epochs are not spent on what all images have in common.
        """
        mean = images.mean(dim=0)
        scale = (images - mean).std(correction=0)
        self.mean_image.copy_(mean)
        self.scale.copy_(torch.where(scale > 0, scale, torch.ones(())))
        with torch.no_grad():
            self.image.bias.copy_(torch.logit(mean, eps=MIN_CELL))

    def encode(self, images: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        hidden = torch.relu(self.inward((images - self.mean_image) / self.scale))
        return self.mean(hidden), self.log_variance(hidden).clamp(max=MAX_LOG_VARIANCE)

    def loss(self, images: torch.Tensor, weight: float, noise: torch.Generator) -> torch.Tensor:
        """Binary cross-entropy of the reconstruction and KL of the code, mean of the images."""
        mean, log_variance = self.encode(images)
        drawn = torch.randn(mean.shape, generator=noise, device=mean.device)
        code = mean + drawn * torch.exp(log_variance / 2)
        logits = self.image(torch.relu(self.outward(code)))
        missed = functional.binary_cross_entropy_with_logits(logits, images, reduction="sum")
        prior = _divergence(mean, log_variance).sum()
        return (weight * missed + prior) / len(images)


def _divergence(mean: torch.Tensor, log_variance: torch.Tensor) -> torch.Tensor:
    """Divergence (KL) of each variable of each image from the prior."""
    return -0.5 * (1 + log_variance - mean**2 - log_variance.exp())
