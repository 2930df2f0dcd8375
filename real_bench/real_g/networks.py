"""An ensemble of small networks, each learning from its own sample of the data."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import torch

from real_bench.errors import RealBenchError
from real_bench.real_g.arrays import Array
from real_bench.real_x.threads import fixed_threads
from real_bench.text.counting import counted

Loss = Callable[[torch.Tensor, torch.Tensor], torch.Tensor]
"""From outputs (E, b, O) and the numbers of the rows they are of (E, b) to losses (E, b)."""

Layers = list[tuple[torch.Tensor, torch.Tensor]]

RATE, DECAY = 2e-3, 5e-2
N_CHECKS = 25
MAX_CHECK_ROWS = 1000
CLIP = 10.0


class Ensemble:
    """Networks of two hidden layers.

    Each learns from a bootstrap sample, and stops where it is best on data outside its sample.

    Args:
        seed: of weights, samples and order.
        outputs: O, of each network.
        members: E, how many networks.
        hidden: units in each hidden layer.
        batch: rows in a step of training.
    """

    def __init__(
        self, seed: int, outputs: int, members: int = 5, hidden: int = 64, batch: int = 64
    ) -> None:
        self._seed, self._outputs, self.members = seed, outputs, members
        self._hidden, self._batch = hidden, batch
        self._layers: Layers = []
        self._mean = self._deviation = np.zeros(0)

    @property
    def is_trained(self) -> bool:
        """Whether it has learned anything yet."""
        return bool(self._layers)

    @fixed_threads
    def train(self, features: Array, loss: Loss, steps: int) -> None:
        """Learn from scratch.

        Args:
            features: (n, F).
            loss: what each member minimises.
            steps: of AdamW.
        """
        n = len(features)
        if n == 0 or not np.isfinite(features).all():
            raise RealBenchError(f"networks cannot learn from {counted(n, 'row')}, or from NaN")
        self._mean, self._deviation = features.mean(axis=0), features.std(axis=0)
        self._deviation = np.where(self._deviation < 1e-9, 1.0, self._deviation)
        random = torch.Generator().manual_seed(self._seed)
        layers = self._initial_layers(features.shape[1], random)
        parameters = [tensor for layer in layers for tensor in layer]
        best, lowest = [tensor.clone() for tensor in parameters], torch.full((self.members,), 1e9)
        for tensor in parameters:
            tensor.requires_grad_(True)
        x = self._scaled(features)
        in_bag = torch.randint(n, (self.members, n), generator=random)
        out_of_bag = _out_of_bag(in_bag, n, random)
        optimizer = torch.optim.AdamW(parameters, lr=RATE, weight_decay=DECAY)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, steps, RATE / 20)
        for step in range(1, steps + 1):
            pick = torch.randint(n, (self.members, min(self._batch, n)), generator=random)
            rows = in_bag.gather(1, pick)
            optimizer.zero_grad(set_to_none=True)
            loss(_forward(layers, x[rows]), rows).mean(dim=1).sum().backward()  # type: ignore[no-untyped-call]
            optimizer.step()
            schedule.step()
            if step % max(1, steps // N_CHECKS) == 0:
                with torch.no_grad():
                    now = loss(_forward(layers, x[out_of_bag]), out_of_bag).mean(dim=1)
                    for kept, tensor in zip(best, parameters, strict=True):
                        kept[now < lowest] = tensor[now < lowest]
                    lowest = torch.minimum(now, lowest)
        self._layers = list(zip(best[::2], best[1::2], strict=True))

    @fixed_threads
    def predict(self, features: Array, member: int | None = None) -> torch.Tensor:
        """Outputs (E, n, O) of all members, or (1, n, O) of one, for (n, F) features."""
        layers = self._layers
        if member is not None:
            layers = [(w[member : member + 1], b[member : member + 1]) for w, b in layers]
        x = self._scaled(features)
        with torch.no_grad():
            return _forward(layers, x.expand(len(layers[0][0]), *x.shape))

    def get_state(self) -> dict[str, Any]:
        """What it has learned."""
        return {
            "layers": [[weights.numpy(), bias.numpy()] for weights, bias in self._layers],
            "mean": self._mean,
            "deviation": self._deviation,
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on with what it has learned."""
        self._layers = [
            (torch.tensor(weights), torch.tensor(bias)) for weights, bias in state["layers"]
        ]
        self._mean, self._deviation = np.asarray(state["mean"]), np.asarray(state["deviation"])

    def _initial_layers(self, n_inputs: int, random: torch.Generator) -> Layers:
        sizes = [n_inputs, self._hidden, self._hidden, self._outputs]
        layers = []
        for number, (n, m) in enumerate(pairwise(sizes)):
            bound = math.sqrt((6.0 if number < 2 else 1.0) / n)
            weights = (torch.rand((self.members, n, m), generator=random) * 2 - 1) * bound
            layers.append((weights, torch.zeros(self.members, 1, m)))
        return layers

    def _scaled(self, features: Array) -> torch.Tensor:
        scaled = np.clip((features - self._mean) / self._deviation, -CLIP, CLIP)
        return torch.from_numpy(scaled.astype(np.float32))


def _forward(layers: Layers, x: torch.Tensor) -> torch.Tensor:
    for number, (weights, bias) in enumerate(layers):
        x = torch.baddbmm(bias, x, weights)
        if number < len(layers) - 1:
            x = torch.relu(x)
    return x


def _out_of_bag(in_bag: torch.Tensor, n: int, random: torch.Generator) -> torch.Tensor:
    """For each member as many rows outside its sample; any rows if there are too few."""
    rows = []
    for sample in in_bag:
        outside = torch.ones(n, dtype=torch.bool)
        outside[sample] = False
        found = outside.nonzero()[:, 0]
        found = found[torch.randperm(len(found), generator=random)]
        rows.append(found if len(found) else torch.arange(n))
    n_rows = min(MAX_CHECK_ROWS, *(len(found) for found in rows))
    return torch.stack([found[:n_rows] for found in rows])
