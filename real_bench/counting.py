"""Numbers of things, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable


def counted(number: int, noun: str) -> str:
    """``1 goal``, ``50 goals``."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def tallied(kinds: Iterable[str]) -> str:
    """``2 of a, 1 of b``: how many there are of each kind, the most frequent first."""
    return ", ".join(f"{number} of {kind}" for kind, number in Counter(kinds).most_common())
