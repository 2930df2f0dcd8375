"""What an action will do to an object, learned from what actions did."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch.nn import functional

from real_bench.errors import RealBenchError
from real_bench.real_g.arrays import Array
from real_bench.real_g.networks import Ensemble

MIN_ACTIONS = 30
"""The fewest actions that are learned from."""

MIN_LOG, MAX_LOG = -6.0, 1.0
SIZE = 3


class ContingencyModel:
    """Whether an object will follow the hand: an ensemble of networks.

    Args:
        seed: of all randomness in learning.
    """

    def __init__(self, seed: int) -> None:
        self._networks = Ensemble(seed, outputs=1)
        self.members = self._networks.members

    @property
    def is_trained(self) -> bool:
        """Whether it has learned anything yet."""
        return self._networks.is_trained

    def train(self, features: Array, contingency: Array, steps: int) -> None:
        """Learn from scratch from n actions: (n, F) and (n,) from 0 to 1."""
        target = torch.from_numpy(contingency.astype(np.float32))

        def loss(outputs: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
            return functional.binary_cross_entropy_with_logits(
                outputs[..., 0], target[rows], reduction="none"
            )

        self._networks.train(features, loss, steps)

    def predict(self, features: Array, member: int | None = None) -> Array:
        """The expectation of one member for n actions, (n,), or the mean of all."""
        outputs = self._networks.predict(features, member)[..., 0].sigmoid().mean(dim=0)
        return np.asarray(outputs.double().numpy())

    def get_state(self) -> dict[str, Any]:
        """What it has learned."""
        return self._networks.get_state()

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with what it has learned."""
        self._networks.set_state(state)


@dataclass(frozen=True)
class Mixture:
    """Outcomes as several members of an ensemble expect them, each as K Gaussians.

    Attributes:
        weights: (E, n, K), their sum 1.
        means, deviations: (E, n, K, 3).
    """

    weights: Array
    means: Array
    deviations: Array


class OutcomeModel:
    """Where an object will be: an ensemble of mixture density networks (Bishop 1994).

    The first half of the K Gaussians is relative to where the object stays, the other half to where
    it follows the hand.

    Args:
        seed: of all that is random in learning.
        scale: the unit in which outcomes are learned, about the length of what can be reached.
        pairs: half of K.
    """

    def __init__(self, seed: int, scale: float, pairs: int = 2) -> None:
        self._scale, self._pairs = scale, pairs
        self._networks = Ensemble(seed, 2 * pairs * (1 + 2 * SIZE), hidden=96, batch=64)

    @property
    def is_trained(self) -> bool:
        """Whether it has learned anything yet."""
        return self._networks.is_trained

    def train(self, features: Array, outcomes: Array, static_outcomes: Array, steps: int) -> None:
        """Learn from scratch from n actions.

        Args:
            features: of each, (n, F).
            outcomes: the outcome of each, (n, 3).
            static_outcomes: the outcome of each if nothing had moved, (n, 3).
            steps: of training.
        """
        if outcomes.shape != (len(features), SIZE):
            raise RealBenchError(
                f"a model cannot learn from {features.shape} with {outcomes.shape}"
            )
        base = self._bases(static_outcomes)
        y = torch.from_numpy((outcomes / self._scale).astype(np.float32))

        def loss(outputs: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
            return -_log_likelihood(*self._parse(outputs, base[rows]), y[rows])

        self._networks.train(features, loss, steps)

    def predict(
        self, features: Array, static_outcomes: Array, member: int | None = None
    ) -> Mixture:
        """What n actions will do; as one member of the ensemble thinks, or all of them."""
        outputs, base = self._networks.predict(features, member), self._bases(static_outcomes)
        logits, means, log_deviations = self._parse(outputs, base.expand(len(outputs), *base.shape))
        return Mixture(
            logits.softmax(dim=2).double().numpy(),
            means.double().numpy() * self._scale,
            log_deviations.exp().double().numpy() * self._scale,
        )

    def get_state(self) -> dict[str, Any]:
        """What it has learned."""
        return self._networks.get_state()

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with what it has learned."""
        self._networks.set_state(state)

    def _parse(
        self, outputs: torch.Tensor, base: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Logits (E, b, K), means and log deviations (E, b, K, 3)."""
        k = 2 * self._pairs
        e, b, _ = outputs.shape
        logits, rest = outputs[:, :, :k], outputs[:, :, k:].reshape(e, b, k, 2, SIZE)
        log_deviations = MIN_LOG + (MAX_LOG - MIN_LOG) * torch.sigmoid(rest[:, :, :, 1])
        return logits, base + rest[:, :, :, 0], log_deviations

    def _bases(self, static_outcomes: Array) -> torch.Tensor:
        """The origins of the Gaussians' means, (n, K, 3)."""
        base = torch.zeros(len(static_outcomes), 2 * self._pairs, SIZE)
        static = torch.from_numpy((static_outcomes / self._scale).astype(np.float32))
        base[:, : self._pairs] = static[:, None]
        return base


def _log_likelihood(
    logits: torch.Tensor, means: torch.Tensor, log_deviations: torch.Tensor, y: torch.Tensor
) -> torch.Tensor:
    """Of outcomes (E, b, 3), without the constant, (E, b)."""
    z = (y[:, :, None] - means) * torch.exp(-log_deviations)
    each = -0.5 * (z * z).sum(dim=3) - log_deviations.sum(dim=3)
    return torch.logsumexp(torch.log_softmax(logits, dim=2) + each, dim=2)
