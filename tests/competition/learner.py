"""A submission that learns, and results that are forged."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from real_bench.scoring.result_file import sealed

LEARNER = """
import numpy as np

from real_bench.actions import Action
from real_bench.controller import Controller


class Learner(Controller):
    '''Learns one number from what it went through, and acts by it.'''

    def __init__(self, action_space, observation_space):
        super().__init__(action_space, observation_space)
        self.seed(0)
        self.learned = 0.0

    def seed(self, seed):
        self._random = np.random.default_rng(seed)

    def next_action(self, observation):
        x, y = self._random.uniform((-0.2, -0.4), (0.0, 0.4))
        return Action.macro([[x, y], [x + self.learned, -y]])

    def use_experience(self, experience):
        if self.learned == 0.0:
            commands = experience.action(0).commands
            self.learned = float(np.abs(commands).sum() % 0.05) + 0.001

    def get_state(self):
        return {"learned": self.learned}

    def set_state(self, state):
        self.learned = state["learned"]
"""


def forge(result: Path, change: Callable[[dict[str, Any]], None]) -> None:
    """Change a result, and seal it anew."""
    content = json.loads(result.read_text())
    change(content)
    result.write_text(json.dumps(sealed(content)))
