"""Five submissions, of which one is good: what an organiser meets."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from real_bench.competition.template import CONTROLLER

ROUND: dict[str, Any] = {
    "condition": "OM",
    "goals": "goals.npy",
    "steps": 3000,
    "trial_steps": 1500,
    "limits": {"memory_gib": 4, "call_s": 12, "total_s": 120},
}

GOOD = CONTROLLER.replace("MyController", "Good")

MALICIOUS = """
import os
import pathlib
import socket
import stat

import real_bench.scoring.metric

real_bench.scoring.metric.object_scores = lambda distances: [1.0]


class Malicious(Good):
    n_actions = 0

    def next_action(self, observation):
        self.n_actions += 1
        if self.n_actions == 2:
            for place in PLACES:
                try:
                    pathlib.Path(place).write_text("owned")
                except OSError:
                    pass
            for number in range(3, 256):
                try:
                    is_channel = stat.S_ISSOCK(os.fstat(number).st_mode)
                except OSError:
                    continue
                if is_channel:
                    with socket.socket(fileno=os.dup(number)) as channel:
                        channel.sendall(b"\\xff" * 1000)
        return super().next_action(observation)
"""

HANGING = """
import time


class Hanging(Good):
    n_actions = 0

    def next_action(self, observation):
        self.n_actions += 1
        if self.n_actions == 2:
            time.sleep(1e6)
        return super().next_action(observation)
"""

CRASHING = """

class Crashing(Good):
    tested = False

    def start_extrinsic_trial(self):
        self.tested = True

    def next_action(self, observation):
        if self.tested:
            raise ValueError("no idea")
        return super().next_action(observation)
"""

MISSING = "import a_package_that_nobody_has\n"

MEMORY = """

class Greedy(Good):
    def next_action(self, observation):
        self.pieces = [bytearray(2**26) for _ in range(4096)]
        return super().next_action(observation)
"""


def derived(code: str, **names: Any) -> str:
    """A controller's code after that of a good one, with some names known to it."""
    known = "".join(f"{name} = {value!r}\n" for name, value in names.items())
    return f"{GOOD}\n{known}{code}"


def hand_in(place: Path, victim: Path) -> Path:
    """All five, beside one another."""
    submission(place / "good", GOOD)
    submission(
        place / "malicious",
        derived(MALICIOUS, PLACES=[str(victim), "touched", "/etc/touched"]),
        entry="controller.py:Malicious",
    )
    submission(place / "hanging", derived(HANGING), entry="controller.py:Hanging")
    submission(place / "crashing", derived(CRASHING), entry="controller.py:Crashing")
    submission(place / "missing", MISSING + GOOD)
    return place


def submission(folder: Path, code: str, **changes: Any) -> Path:
    """Write a submission."""
    folder.mkdir(parents=True)
    (folder / "controller.py").write_text(code)
    fields = {
        "name": folder.name.capitalize(),
        "authors": ["Somebody"],
        "entry": "controller.py",
        "condition": "OM",
        **changes,
    }
    (folder / "submission.yaml").write_text(json.dumps(fields))  # JSON is YAML
    return folder


def rounds(folder: Path, **changes: Any) -> Path:
    """Write the file of a competition with one round."""
    path = folder / "round.yaml"
    fields = {"title": "Tiny", "scene": "builtin", "rounds": {"first": {**ROUND, **changes}}}
    path.write_text(json.dumps(fields))
    return path
