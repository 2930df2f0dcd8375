"""Follow a recording as it grows."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from real_bench.watching.status import PlayStatus, read_status

SPEED_OVER_S = 60.0
"""Speed is that of the last minute."""


@dataclass(frozen=True)
class Moment:
    """The progress of a play, and its speed.

    Attributes:
        status: its progress.
        speed: steps per second in the last minute; None if it was seen only once.
    """

    status: PlayStatus
    speed: float | None

    @property
    def seconds_left(self) -> float | None:
        """How long the play will go on at this speed; None if unknown."""
        if not self.speed or self.status.what != "playing":
            return None
        return (self.status.total_steps - self.status.n_steps) / self.speed


def follow(path: Path, every_s: float) -> Iterator[Moment]:
    """The state of a recording, now and whenever it changes, until its play ends or stops.

    Args:
        path: the recording, which must exist.
        every_s: how often to look.

    Raises:
        RecordingError: it is not a recording.
    """
    marks: deque[tuple[float, int]] = deque()
    last: object = None
    while True:
        status = read_status(path)
        state = (status.n_steps, status.what, len(status.logged), status.written_at)
        if state != last:
            last = state
            yield Moment(status, _speed(marks, status))
        if status.what in ("ended", "stopped"):
            return
        time.sleep(every_s)


def _speed(marks: deque[tuple[float, int]], status: PlayStatus) -> float | None:
    """Steps per second between writes; an unfinished action is not included."""
    if not marks or status.written_at > marks[-1][0]:
        marks.append((status.written_at, status.n_steps))
    while len(marks) > 2 and marks[1][0] < status.written_at - SPEED_OVER_S:
        marks.popleft()
    (began, before), (now, after) = marks[0], marks[-1]
    return (after - before) / (now - began) if now > began else None
