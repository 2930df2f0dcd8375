"""What a controller is busy with while nothing is simulated, reported to watchers."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Protocol

LEARNING, PLANNING = "learning", "planning"


class Activity(Protocol):
    """Called with what a controller is busy with; gives a context that lasts as long."""

    def __call__(self, what: str, /) -> AbstractContextManager[object]:
        """The controller is busy with this."""


def ignore_activity(what: str, /) -> AbstractContextManager[object]:
    """Nobody watches."""
    return nullcontext()
