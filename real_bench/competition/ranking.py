"""Who comes before whom, and who cannot be told apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from real_bench.competition.round_file import NOT_OF_THIS_ROUND, RoundFacts, result_name
from real_bench.competition.standing import SCORED, UNTOLD, WAITING, Standing
from real_bench.competition.verified import KeptVerdict, load_verified
from real_bench.errors import ResultError
from real_bench.files.hashing import file_sha256
from real_bench.scoring.comparison import MetricComparison, compare
from real_bench.scoring.one_test import check_one_test
from real_bench.scoring.repeats import RepeatsSummary, by_goal, summarise_repeats
from real_bench.scoring.result import Result, load_result

ZERO = "zero"


@dataclass(frozen=True)
class Row:
    """A submission on the leaderboard.

    Attributes:
        standing: what it says of itself, and its status, as it may be shown.
        home: the folder of its files.
        files: its results.
        results: the same, read.
        summary: of these; None if it is not scored.
        verified: the verdict on them; None if nobody verified them.
        rank: its place, which a group may share; None if it has none.
        against_first: the comparison with the first of its group; None for that one itself.
    """

    standing: Standing
    home: Path
    files: tuple[Path, ...] = ()
    results: tuple[Result, ...] = ()
    summary: RepeatsSummary | None = None
    verified: KeptVerdict | None = None
    rank: int | None = None
    against_first: MetricComparison | None = None

    @property
    def mean(self) -> float:
        """What it is ranked by: 0 if it failed."""
        return 0.0 if self.summary is None else self.summary.score.mean

    def to_json(self) -> dict[str, Any]:
        """All of it but what is in the results."""
        return {
            "rank": self.rank,
            **self.standing.model_dump(mode="json"),
            "files": [file.name for file in self.files],
            "summary": self.summary.to_json() if self.summary else None,
            "against_first_of_rank": (
                None if self.against_first is None else asdict(self.against_first)
            ),
            "verified": None if self.verified is None else self.verified.model_dump(mode="json"),
        }


def read_rows(folder: Path, facts: RoundFacts) -> list[Row]:
    """The current version of each submission in a round's folder; raises RealBenchError."""
    versions: dict[str, list[tuple[Path, Standing]]] = {}
    for home in sorted(path for path in folder.iterdir() if path.is_dir()):
        standing = Standing.load(home)
        if standing is not None:
            versions.setdefault(standing.key, []).append((home, standing))
    return [
        _row(*_current(facts.current.get(key, ""), known), facts)
        for key, known in sorted(versions.items())
    ]


def _current(name: str, versions: Sequence[tuple[Path, Standing]]) -> tuple[Path, Standing]:
    """The version of this name; the newest if there is none of it."""
    newest = max(versions, key=lambda version: version[1].date)
    return next((version for version in versions if version[0].name == name), newest)


def ranked(rows: Sequence[Row], failure: str, ties: str) -> list[Row]:
    """Rows in the order of their ranks, those without a rank last.

    Args:
        rows: the submissions of one round.
        failure: how a failed one counts: ``zero`` or ``excluded``.
        ties: ``paired`` or ``none``.
    """
    scored = sorted(
        (row for row in rows if row.summary is not None),
        key=lambda row: (-row.mean, row.standing.key),
    )
    placed: list[Row] = []
    for number, row in enumerate(scored, start=1):
        first = next((each for each in placed if each.rank == placed[-1].rank), None)
        against = None if first is None else _tie(row, first, ties)
        rank = first.rank if first is not None and against is not None else number
        placed.append(replace(row, rank=rank, against_first=against))
    failed = sorted(
        (row for row in rows if row.summary is None),
        key=lambda row: (row.standing.status == WAITING, row.standing.key),
    )
    last = len(placed) + 1
    return placed + [
        replace(row, rank=last if failure == ZERO and row.standing.status != WAITING else None)
        for row in failed
    ]


def _tie(row: Row, first: Row, ties: str) -> MetricComparison | None:
    """The comparison with the first of a group, if it cannot tell the two apart."""
    compared = compare(row.results, first.results).score
    if ties == "none":
        return compared if compared.difference == 0 else None
    interval = compared.interval
    cannot_tell = interval is None or interval.low <= 0 <= interval.high
    return compared if cannot_tell else None


def _row(home: Path, standing: Standing, facts: RoundFacts) -> Row:
    if standing.status != SCORED:
        return Row(facts.shown(facts.without_old_failures(standing)), home)
    files = tuple(sorted(home.glob("*[0-9].json")))
    if facts.seeds:
        files = tuple(home / result_name(seed) for seed in facts.seeds)
    try:
        results = tuple(load_result(file) for file in files if file.exists())
        if not results or len(results) < len(files) or not all(map(facts.includes, results)):
            return _waiting(home, standing, NOT_OF_THIS_ROUND)
    except ResultError as error:
        return _waiting(home, standing, str(error).replace(f"{home}/", ""))
    try:
        check_one_test(results)
        summary = summarise_repeats(by_goal(results))
    except ResultError as error:  # with settings, by which a controller could tell of goals
        return _waiting(home, standing, UNTOLD if facts.hidden else str(error))
    return Row(standing, home, files, results, summary, _verdict(home, files, facts))


def _verdict(home: Path, files: Sequence[Path], facts: RoundFacts) -> KeptVerdict | None:
    """The verdict on results; without the reason where it could tell of secret goals."""
    verdict = load_verified(home, [file_sha256(file) for file in files])
    if verdict is None or verdict.holds or not facts.hidden:
        return verdict
    return verdict.model_copy(update={"detail": UNTOLD})


def _waiting(home: Path, standing: Standing, detail: str) -> Row:
    return Row(standing.model_copy(update={"status": WAITING, "detail": detail}), home)
