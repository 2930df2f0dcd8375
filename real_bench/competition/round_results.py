"""The results of a round, as they are verified: which of them, on which goals, with what limits."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from real_bench.competition.ranking import Row, read_rows
from real_bench.competition.round_file import RoundFacts
from real_bench.competition.standing import Standing
from real_bench.errors import GoalSetError, RealBenchError, ResultError
from real_bench.goal_sets import load_goal_set
from real_bench.scoring.result import load_result
from real_bench.text.quoting import quoted

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RoundResults:
    """The results of a round.

    Attributes:
        facts: of the round.
        rows: of its leaderboard, by the names of their folders.
        goals: its goal set; None: somebody has to give it.
    """

    facts: RoundFacts
    rows: Mapping[str, Row]
    goals: Path | None

    def why_passed_over(self, result: Path, goals: str | None, scene: str | None) -> str:
        """Why a result in it is not verified; empty if it is.

        Only those that the leaderboard shows are verified, and those that cannot be read.

        Args:
            result: the file.
            goals: the hash of those that are given; None: none are.
            scene: the same of the scene.
        """
        if goals not in (None, self.facts.goals_sha256):
            return f"round {quoted(self.facts.name)} is on other goals than those of --goals"
        if self.facts.scene_sha256 and scene not in (None, self.facts.scene_sha256):
            return f"round {quoted(self.facts.name)} is in another scene than that of --scene"
        row = self.rows.get(result.resolve().parent.name)
        if row is None:
            return "of an earlier version"
        if result.name in {file.name for file in row.files} or not _is_readable(result):
            return ""
        if row.files:
            return "not of the round as it is now"
        return f"of a submission that is not scored ({row.standing.status})"


def rounds_of(homes: Iterable[Path], *, apart_from: Path) -> dict[Path, RoundResults]:
    """The round of each submission's folder, for those that are in one.

    Goals among a round's results, or in the folder ``apart_from``, are not taken: whoever sends in
    results could bring goals of their own.
    """
    rounds: dict[Path, RoundResults | None] = {}
    found: dict[Path, RoundResults] = {}
    for home in homes:
        if not (home / Standing.FILE).exists():
            continue
        folder = home.resolve().parent
        if folder not in rounds:
            rounds[folder] = _read(folder, apart_from)
        its_round = rounds[folder]
        if its_round is not None:
            found[home] = its_round
    return found


def _read(folder: Path, apart_from: Path) -> RoundResults | None:
    try:
        facts = RoundFacts.load(folder)
        if facts is None:
            return None
        rows = {row.home.name: row for row in read_rows(folder, facts)}
    except RealBenchError as error:
        log.warning("%s is verified like results by mail, not as a round: %s", folder, error)
        return None
    return RoundResults(facts, rows, _goals(facts, (folder.parent, apart_from.resolve())))


def _goals(facts: RoundFacts, apart_from: Iterable[Path]) -> Path | None:
    """A round's goal set, if it still lies where it was, and in none of these folders."""
    path = Path(facts.goals)
    if not path.is_file() or any(path.resolve().is_relative_to(each) for each in apart_from):
        return None
    try:
        return path if load_goal_set(path).sha256 == facts.goals_sha256 else None
    except GoalSetError:
        return None


def _is_readable(result: Path) -> bool:
    try:
        load_result(result)
    except ResultError:
        return False
    return True
