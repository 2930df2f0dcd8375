"""Numbers of things, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable


def counted(number: int, noun: str) -> str:
    """``1 goal``, ``50 goals``."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def tallied_if_mixed(kinds: Iterable[str]) -> str:
    """``2 of a, 1 of b``, the most frequent kind first; empty if there is only one kind."""
    counts = Counter(kinds).most_common()
    return ", ".join(f"{number} of {kind}" for kind, number in counts) if len(counts) > 1 else ""
