"""What a controller is busy with while nothing is simulated, told to whoever watches."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Protocol

LEARNING, PLANNING = "learning", "planning"


class Activity(Protocol):
    """Told what a controller is busy with, as a context manager that lasts as long as that."""

    def __call__(self, what: str, /) -> AbstractContextManager[object]:
        """The controller is busy with this."""


def unwatched(what: str, /) -> AbstractContextManager[object]:
    """Nobody watches."""
    return nullcontext()
