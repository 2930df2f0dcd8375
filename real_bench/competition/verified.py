"""What came of verifying a submission's results, kept beside them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from real_bench.competition.kept import KeptRecord


class Verified(KeptRecord):
    """A verdict on results.

    Attributes:
        results: hashes of their files; of other files it says nothing.
        holds: whether they are proved.
        detail: the verdict in a line.
        date: when.
    """

    FILE: ClassVar[str] = "verified.json"

    results: tuple[str, ...]
    holds: bool
    detail: str
    date: str


def load_verified(home: Path, results: Sequence[str]) -> Verified | None:
    """What is known of results of these hashes; None where nothing is."""
    verified = Verified.load(home)
    return verified if verified and set(results) <= set(verified.results) else None
