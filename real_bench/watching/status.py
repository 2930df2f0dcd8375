"""The state of a recording at one moment of a play."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.files.locks import is_being_written
from real_bench.recording import MOVED_M, Header, Recording

LATEST_ACTIONS = 500
"""Actions over which the share that moved an object is taken, as in the paper's figures."""


@dataclass(frozen=True, eq=False)
class PlayStatus:
    """The progress of a play, by what it has written.

    Attributes:
        path, header: of the recording.
        n_steps, total_steps: steps so far, and asked for.
        ended: whether the play is over, including all learning.
        is_played: whether a process is playing now.
        written_at: when this was written, in seconds since 1970.
        ended_at: the step at which each action ended, (n,).
        moved: whether it moved an object by more than 1 cm, (n,).
        logged: what the controller logged (see ``Recording.logged``).
    """

    path: Path
    header: Header
    n_steps: int
    total_steps: int
    ended: bool
    is_played: bool
    written_at: float
    ended_at: NDArray[np.int64]
    moved: NDArray[np.bool_]
    logged: NDArray[Any]

    @property
    def n_actions(self) -> int:
        """How many actions there are."""
        return len(self.moved)

    @property
    def share_moved(self) -> float | None:
        """The share of actions that moved an object; None without actions."""
        return float(self.moved.mean()) if self.n_actions else None

    @property
    def share_moved_recently(self) -> float | None:
        """The same of the last 500 actions."""
        return float(self.moved[-LATEST_ACTIONS:].mean()) if self.n_actions else None

    @property
    def what(self) -> str:
        """What is going on: ended, playing, learning, or stopped."""
        if self.ended:
            return "ended"
        if not self.is_played:
            return "stopped"
        return "playing" if self.n_steps < self.total_steps else "learning"

    def numbers(self) -> dict[str, tuple[NDArray[np.int64], NDArray[np.float64]]]:
        """What was logged by name, in the order of first use: steps and values."""
        names = self.logged["name"]
        return {
            name: (self.logged["step"][names == name], self.logged["value"][names == name])
            for name in dict.fromkeys(names)
        }

    def to_json(self) -> dict[str, Any]:
        """Its facts as plain values."""
        latest = {}
        for name, (_, values) in self.numbers().items():
            latest[name] = float(values[-1]) if np.isfinite(values[-1]) else None
        return {
            "state": self.what,
            "steps": self.n_steps,
            "steps_asked": self.total_steps,
            "actions": self.n_actions,
            "share_of_actions_that_moved_an_object": self.share_moved,
            f"of_the_last_{LATEST_ACTIONS}": self.share_moved_recently,
            "logged": latest,
        }


def read_status(path: Path) -> PlayStatus:
    """Read the present state of a recording; raises RecordingError if it is not one."""
    is_played = is_being_written(path)  # checked before reading, so that an end is not missed
    with Recording(path) as recording:
        rows = recording.transitions
        return PlayStatus(
            path=path,
            header=recording.header,
            n_steps=recording.n_steps,
            total_steps=recording.total_steps,
            ended=recording.ended,
            is_played=is_played,
            written_at=path.stat().st_mtime,
            ended_at=rows["first_step"] + rows["n_steps"],
            moved=np.asarray((recording.displacements() > MOVED_M).any(axis=1)),
            logged=recording.logged,
        )
