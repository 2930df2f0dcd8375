"""Follow a recording as it grows."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from real_bench.watching.snapshot import Snapshot, read_snapshot

SPEED_OVER_S = 60.0
"""Speed is told of the last minute."""


@dataclass(frozen=True)
class Moment:
    """A snapshot, and how fast it goes.

    Attributes:
        snapshot: what is the case.
        speed: steps a second in the last minute; None where it was seen only once.
    """

    snapshot: Snapshot
    speed: float | None

    @property
    def seconds_left(self) -> float | None:
        """How long the play will go on at this speed; None where that is not known."""
        if not self.speed or self.snapshot.what != "playing":
            return None
        return (self.snapshot.total_steps - self.snapshot.n_steps) / self.speed


def follow(path: Path, every_s: float) -> Iterator[Moment]:
    """What a recording says, now and whenever it changes, until its play has ended or stopped.

    Args:
        path: the recording, which must be there.
        every_s: how often to look.

    Raises:
        RecordingError: it is not a recording.
    """
    seen: deque[tuple[float, int]] = deque()
    last: object = None
    while True:
        snapshot = read_snapshot(path)
        told = (snapshot.n_steps, snapshot.what, len(snapshot.logged), snapshot.written_at)
        if told != last:
            last = told
            yield Moment(snapshot, _speed(seen, snapshot))
        if snapshot.what in ("ended", "stopped"):
            return
        time.sleep(every_s)


def _speed(seen: deque[tuple[float, int]], snapshot: Snapshot) -> float | None:
    """Steps a second between writings; an action that has just begun is in none."""
    if not seen or snapshot.written_at > seen[-1][0]:
        seen.append((snapshot.written_at, snapshot.n_steps))
    while len(seen) > 2 and seen[1][0] < snapshot.written_at - SPEED_OVER_S:
        seen.popleft()
    (began, before), (now, after) = seen[0], seen[-1]
    return (after - before) / (now - began) if now > began else None
