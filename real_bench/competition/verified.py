"""The verdict on a submission's results, kept beside them."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import ClassVar

from real_bench.competition.kept import KeptRecord
from real_bench.verification import BundleVerdict


class KeptVerdict(KeptRecord):
    """A verdict on results.

    Attributes:
        results: hashes of their files; it applies to no others.
        holds: whether they are proved, as far as they were checked.
        unchecked: what was not checked, or not to the end.
        detail: the verdict in a line.
        date: when.
    """

    FILE: ClassVar[str] = "verified.json"

    results: tuple[str, ...]
    holds: bool
    unchecked: tuple[str, ...] = ()
    detail: str
    date: str


def load_verified(home: Path, results: Sequence[str]) -> KeptVerdict | None:
    """The verdict on results of these hashes; None if there is none."""
    verified = KeptVerdict.load(home)
    return verified if verified and set(results) <= set(verified.results) else None


def keep_verdicts(home: Path, verdicts: Sequence[BundleVerdict]) -> None:
    """Keep verdicts on a submission's results in a round beside them, for the leaderboard.

    A submission is verified where all its results are. If one fails, it is not; otherwise nothing
    is kept where one is undecided.
    """
    worst = max(verdicts, key=lambda each: (_fails(each), each.is_undecided, len(each.unchecked)))
    if worst.is_undecided:
        return
    KeptVerdict(
        results=tuple(verdict.result_sha256 for verdict in verdicts),
        holds=worst.holds,
        unchecked=worst.unchecked,
        detail=worst.detail,
        date=datetime.now(timezone.utc).isoformat(timespec="seconds"),
    ).save(home)


def _fails(verdict: BundleVerdict) -> bool:
    return not verdict.holds and not verdict.is_undecided
