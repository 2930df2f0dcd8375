"""Runs inside a venv of the official package: its steps/s for macros, through its own evaluation.

Called by bench.py; prints one number. It must not import realbench.
"""

import sys
import time

import numpy as np
import real_robots
from real_robots.policy import BasePolicy

STEPS_PER_MACRO = 1000


class Stopwatch(BasePolicy):
    """Random macros for so many steps, then the rate, then the end."""

    def __init__(self, action_space, observation_space):
        self._random = np.random.default_rng(0)
        self._step = 0

    def step(self, observation, reward, done):
        """The same macro for 1000 steps, then another."""
        if self._step % STEPS_PER_MACRO == 0:
            x = self._random.uniform(-0.25, 0.05, 2)
            y = self._random.uniform(-0.5, 0.5, 2)
            self._macro = np.stack([x, y], axis=1)
        if self._step == STEPS_PER_MACRO:  # the first macro warms up
            self._began = time.perf_counter()
        if self._step == N_STEPS + STEPS_PER_MACRO:
            print("rate", N_STEPS / (time.perf_counter() - self._began), flush=True)
            sys.exit(0)
        self._step += 1
        return {"macro_action": self._macro, "render": False}


N_STEPS = int(sys.argv[1])
real_robots.evaluate(
    Stopwatch,
    environment="R1",
    action_type="macro_action",
    n_objects=1,
    intrinsic_timesteps=2 * N_STEPS,
    extrinsic_trials=0,
    visualize=False,
    goals_dataset_path=__file__,  # it must exist, and is not read before the tests
)
