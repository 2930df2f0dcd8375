"""A submission to start from."""

from __future__ import annotations

from pathlib import Path

from real_bench.controller_code.manifest import MANIFEST, read_submission
from real_bench.errors import SubmissionError
from real_bench.files.atomic import write_atomically
from real_bench.files.outputs import check_folder
from real_bench.inputs.yaml_files import as_yaml

_MANIFEST = """\
# What the organisers and the leaderboard show.
name: {name}
authors: [{author}]
entry: controller.py        # or controller.py:MyClass
condition: {condition}
settings: {{}}                # settings of the controller that differ from its defaults
requirements: []            # packages besides realbench's, e.g. [scikit-learn>=1.4]
description: It acts at random.
"""

CONTROLLER = '''\
"""A controller that acts at random: replace what it does."""

import numpy as np

from real_bench.controller import Controller
from real_bench.real_x import RandomExplorer


class MyController(Controller):
    """Called for whole actions; see `python -c "import real_bench.controller as c; help(c)"`."""

    def __init__(self, action_space, observation_space):
        super().__init__(action_space, observation_space)
        self.seed(0)

    def seed(self, seed):
        """All randomness comes from here: the same seed must give the same play."""
        self._random = np.random.default_rng(seed)
        self._explorer = RandomExplorer(self.action_space, self._random)

    def next_action(self, observation):
        """The next action, whatever it sees."""
        return self._explorer.next_action()

    def get_state(self):
        """What it learned, kept with the recording of its play."""
        return {"random": self._random.bit_generator.state}

    def set_state(self, state):
        """Go on from what get_state() gave."""
        self._random.bit_generator.state = state["random"]
'''


def make_template(folder: Path, name: str, author: str, condition: str) -> None:
    """Write a submission that runs as it is; raises SubmissionError if one is there."""
    taken = [file for file in (MANIFEST, "controller.py") if (folder / file).exists()]
    if taken:
        raise SubmissionError(f"{folder / taken[0]} exists: use another folder")
    check_folder(folder, make=True)
    content = _MANIFEST.format(name=as_yaml(name), author=as_yaml(author), condition=condition)
    write_atomically(folder / "controller.py", CONTROLLER.encode())
    write_atomically(folder / MANIFEST, content.encode())
    try:
        read_submission(folder)
    except SubmissionError:
        for file in (MANIFEST, "controller.py"):
            (folder / file).unlink()
        raise
