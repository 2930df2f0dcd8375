"""A leaderboard: as a table for the terminal, Markdown and JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table

from real_bench.competition.ranking import ZERO, Row, ranked, read_rows
from real_bench.competition.round_file import RoundFacts, load_round
from real_bench.competition.standing import SCORED, WAITING, labels
from real_bench.competition.verified import KeptVerdict
from real_bench.errors import ExperimentError
from real_bench.goal_sets.goal import CHALLENGES
from real_bench.scoring.columns import ABSENT
from real_bench.scoring.parts import describe_sum
from real_bench.scoring.statistics import OVER_GOALS, OVER_PLAYS_AND_GOALS
from real_bench.text.counting import counted
from real_bench.text.naming import scene_name
from real_bench.text.quoting import markdown, quoted

MAX_DETAIL_LENGTH = 300


@dataclass(frozen=True)
class Leaderboard:
    """The ranks of a round.

    Attributes:
        facts: of the round.
        rows: in their order.
    """

    facts: RoundFacts
    rows: tuple[Row, ...]

    @cached_property
    def labels(self) -> dict[str, str]:
        """What each submission is called, by key."""
        return labels([row.standing for row in self.rows])

    def to_json(self) -> dict[str, Any]:
        """All of it."""
        facts = self.facts.model_dump(mode="json", exclude={"goals"})
        facts["scene"] = scene_name(self.facts.scene)  # not where its file is
        return {"round": facts, "rows": [row.to_json() for row in self.rows]}


def read_leaderboards(results: Path, name: str | None = None) -> list[Leaderboard]:
    """The leaderboards of a results folder, or of a round's own.

    Args:
        results: the folder.
        name: of one round; None: all that there are.

    Raises:
        ExperimentError: there is none, or none of that name.
        RealBenchError: a file cannot be read.
    """
    if (results / RoundFacts.FILE).exists():
        folders = [results]
    else:
        folders = sorted(path.parent for path in results.glob(f"*/{RoundFacts.FILE}"))
    known = [folder.name for folder in folders]
    if name is not None:
        folders = [folder for folder in folders if folder.name == name]
    if not folders:
        lines = f"no round {name}" if name and known else "no round"
        more = f" (use {', '.join(known)})" if known else " (`realbench round run` makes one)"
        raise ExperimentError(f"{results} holds {lines}{more}")
    return [_leaderboard(folder) for folder in folders]


def _leaderboard(folder: Path) -> Leaderboard:
    facts = load_round(folder)
    return Leaderboard(facts, tuple(ranked(read_rows(folder, facts), facts.failure, facts.ties)))


def headings() -> list[str]:
    """Of the columns."""
    return ["rank", "submission", "score", "95%", *CHALLENGES, "status", "date", "hash", "verified"]


def cells(board: Leaderboard, row: Row) -> list[str]:
    """What stands in each column of a row."""
    standing, summary = row.standing, row.summary
    numbers = [ABSENT] * (2 + len(CHALLENGES))
    if summary is not None:
        score = summary.score
        by_class = [score.by_class.get(name) for name in CHALLENGES]
        numbers = [
            f"{score.mean:.3f}",
            str(score.interval or ABSENT),
            *(ABSENT if value is None else f"{value:.3f}" for value in by_class),
        ]
    return [
        ABSENT if row.rank is None else str(row.rank),
        board.labels[standing.key],
        *numbers,
        standing.status,
        standing.date[:10],
        standing.sha256[:12],
        _describe_verified(row.verified),
    ]


def title(board: Leaderboard) -> str:
    """What stands above it."""
    return f"{board.facts.title}: round {board.facts.name}"


def notes(board: Leaderboard) -> list[str]:
    """What is to be said below it."""
    facts, rows = board.facts, board.rows
    lines = [_describe_task(facts), *describe_sum(facts.objects)]
    overs = {
        row.summary.score.interval.over
        for row in rows
        if row.summary is not None and row.summary.score.interval is not None
    }
    if OVER_PLAYS_AND_GOALS in overs:
        lines.append(
            f"95%: interval over {OVER_PLAYS_AND_GOALS}: what to expect from new plays and goals"
        )
    elif OVER_GOALS in overs:
        lines.append(
            f"95%: interval over {OVER_GOALS}: on other goals, after the same play (it takes three "
            "plays to know how plays differ)"
        )
    if facts.ties == "paired":
        lines.append(
            "submissions share a rank if the paired comparison, goal by goal, cannot tell them "
            "from the first of them (95%, over plays and goals where both have three plays, else "
            "over goals)"
        )
    for row in rows:
        if row.standing.status != SCORED and row.standing.detail:
            detail = quoted(row.standing.detail, MAX_DETAIL_LENGTH)
            lines.append(f"{board.labels[row.standing.key]}: {detail}")
    for row in rows:
        if row.verified is not None and (row.verified.unchecked or not row.verified.holds):
            detail = quoted(row.verified.detail, MAX_DETAIL_LENGTH)
            lines.append(f"{board.labels[row.standing.key]}: {detail}")
    if facts.failure == ZERO and any(_failed(row) for row in rows):
        lines.append("a failed submission counts as 0")
    if facts.hidden:
        lines.append("the goals are secret until they are released")
    if facts.commitment:
        lines.append(f"commitment to the goals: {facts.commitment}")
    return lines


def _failed(row: Row) -> bool:
    return row.summary is None and row.standing.status != WAITING


def text_table(board: Leaderboard) -> Table:
    """For a terminal."""
    table = Table(
        title=quoted(title(board)),
        caption="\n".join(notes(board)),
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    for heading in headings():
        right = heading in ("rank", "score", "95%", *CHALLENGES)
        table.add_column(heading, justify="right" if right else "left")
    for row in board.rows:
        table.add_row(*cells(board, row))
    return table


def markdown_table(board: Leaderboard) -> str:
    """For a README or a job summary."""
    from tabulate import tabulate

    shown = [[markdown(cell) for cell in cells(board, row)] for row in board.rows]
    table = tabulate(shown, headings(), "github", disable_numparse=True)
    below = "".join(f"\n{markdown(note)}  " for note in notes(board))
    return f"### {markdown(title(board))}\n\n{table}\n{below}"


def _describe_verified(verdict: KeptVerdict | None) -> str:
    if verdict is None:
        return ABSENT
    if not verdict.holds:
        return "NO"
    return "in part" if verdict.unchecked else "yes"


def _describe_task(facts: RoundFacts) -> str:
    objects = counted(facts.objects, "object")
    plays = {
        "own": f"{facts.steps:,} steps of play",
        "given": "a given play",
        "none": "without play",
    }[facts.play]
    repeats = "once" if facts.repeats == 1 else f"{facts.repeats} times"
    goals = counted(facts.n_goals, "goal")
    return (
        f"REAL_{facts.condition}, {objects}, scene {quoted(scene_name(facts.scene))}, {plays}, "
        f"{goals} of {facts.trial_steps:,} steps, each submission {repeats}"
    )


def json_boards(boards: Sequence[Leaderboard]) -> dict[str, Any]:
    """Several leaderboards as JSON, by the name of the round."""
    return {board.facts.name: board.to_json() for board in boards}
