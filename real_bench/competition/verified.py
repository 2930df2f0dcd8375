"""The verdict on a submission's results, kept beside them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from real_bench.competition.kept import KeptRecord


class Verified(KeptRecord):
    """A verdict on results.

    Attributes:
        results: hashes of their files; it applies to no others.
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
    """The verdict on results of these hashes; None if there is none."""
    verified = Verified.load(home)
    return verified if verified and set(results) <= set(verified.results) else None
