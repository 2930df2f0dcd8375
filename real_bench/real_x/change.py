"""Which actions will change what is seen (paper, section REAL-ILD)."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn
from torch.nn import functional

from real_bench.errors import RealBenchError
from real_bench.real_x.threads import fixed_threads
from real_bench.real_x.triplets import Triplets

SHARE_OF_LARGEST = 0.01
"""A state has changed if it differs by more than this share of the largest difference."""

HIDDEN, BATCH, RATE = 128, 64, 1e-3

STEPS = 1500
"""Steps of Adam per training, however few actions there are."""


def changed(triplets: Triplets) -> NDArray[np.bool_]:
    """Which of n actions changed the state, (n,): paper, algorithm of the Change predictor."""
    distances = np.linalg.norm(triplets.states - triplets.outcomes, axis=1)
    largest = distances.max(initial=0.0)
    return np.asarray(distances > SHARE_OF_LARGEST * largest)


class ChangePredictor:
    """A network from a state and an action to whether the state will change.

    An action is given as its commands at one or more moments; it is expected to change something
    if any of them is. So what was learned about a posture holds at every moment.

    Args:
        seed: of the first weights and of the order of training.
        steps: of Adam, in a training.
    """

    def __init__(self, seed: int, steps: int = STEPS) -> None:
        self._seed, self._steps = seed, steps
        self._network: nn.Module | None = None
        self._mean = self._scale = np.zeros(0)

    @fixed_threads
    def train(
        self,
        states: NDArray[np.float64],
        actions: NDArray[np.float64],
        change: NDArray[np.bool_],
    ) -> None:
        """Learn from scratch.

        Args:
            states: before each action, (n, V).
            actions: the commands at k moments of each, (n, k, size).
            change: whether it changed the state, (n,).
        """
        inputs = _join(states, actions)
        if len(inputs) == 0 or change.shape != (len(inputs),):
            raise RealBenchError(
                f"a change predictor cannot learn from {inputs.shape} with {change.shape}"
            )
        self._mean, self._scale = inputs.mean(axis=(0, 1)), inputs.std(axis=(0, 1))
        self._scale[self._scale == 0] = 1.0
        self._network = self._new_network(inputs.shape[2])
        optimizer = torch.optim.Adam(self._network.parameters(), lr=RATE)
        data, target = self._scaled(inputs), torch.from_numpy(change.astype(np.float32))
        random = torch.Generator().manual_seed(self._seed)
        for _ in range(self._steps):
            rows = torch.randint(len(data), (BATCH,), generator=random)
            logits = _max_logit(self._network, data[rows])
            loss = functional.binary_cross_entropy_with_logits(logits, target[rows])
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimizer.step()

    @fixed_threads
    def predict(
        self, states: NDArray[np.float64], actions: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Whether (n, V) states will change by (n, k, size) actions, (n,); none while untrained."""
        if self._network is None:
            return np.zeros(len(states), bool)
        with torch.no_grad():
            logits: NDArray[np.float32] = _max_logit(
                self._network, self._scaled(_join(states, actions))
            ).numpy()
        return logits > 0

    def _new_network(self, n_inputs: int) -> nn.Module:
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(self._seed)
            return nn.Sequential(
                nn.Linear(n_inputs, HIDDEN),
                nn.ReLU(),
                nn.Linear(HIDDEN, HIDDEN),
                nn.ReLU(),
                nn.Linear(HIDDEN, 1),
            )

    def _scaled(self, inputs: NDArray[np.float64]) -> torch.Tensor:
        return torch.from_numpy(((inputs - self._mean) / self._scale).astype(np.float32))


def _join(states: NDArray[np.float64], actions: NDArray[np.float64]) -> NDArray[np.float64]:
    """States joined with every moment of actions, (n, k, V + size)."""
    if states.ndim != 2 or actions.ndim != 3 or len(states) != len(actions):
        raise RealBenchError(
            f"a change predictor needs as many states (n, V) as actions (n, k, size), "
            f"not {states.shape} and {actions.shape}"
        )
    beside = np.repeat(states[:, None], actions.shape[1], axis=1)
    return np.concatenate([beside, actions], axis=2)


def _max_logit(network: nn.Module, inputs: torch.Tensor) -> torch.Tensor:
    """The largest logit over the moments, (n, k, inputs) to (n,)."""
    logits: torch.Tensor = network(inputs)
    return logits[:, :, 0].amax(dim=1)
