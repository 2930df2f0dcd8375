"""A leaderboard as a static site: an index and a page per submission; works from a folder."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from real_bench.competition.leaderboard import (
    Leaderboard,
    cells,
    headings,
    json_boards,
    notes,
    title,
)
from real_bench.competition.ranking import Row
from real_bench.competition.round_file import RoundFacts
from real_bench.errors import GoalSetError
from real_bench.files.atomic import OutputError, write_atomically
from real_bench.files.outputs import check_folder
from real_bench.goal_sets import GoalSet, load_goal_set
from real_bench.report.html import packaged_text, render_html
from real_bench.report.parts import ResultEntry, read_tested
from real_bench.simulation import load_scene
from real_bench.version import __version__

FILMS = "films"
MARK = "realbench.json"
"""The file that marks a folder as such a site; no other folder is replaced."""


@dataclass(frozen=True)
class Page:
    """A submission's page.

    Attributes:
        name: of its file.
        board: the leaderboard that it is on.
        row: its place there.
        tests: its results with pictures, and the addresses of films by goal; none while the goals
            are hidden.
    """

    name: str
    board: Leaderboard
    row: Row
    tests: tuple[tuple[ResultEntry, dict[int, str]], ...]


def write_site(
    boards: Sequence[Leaderboard], folder: Path, *, films: bool, overwrite: bool
) -> list[str]:
    """Write the site; returns remarks for the user.

    Raises:
        OutputError: the folder holds something else, or a site that must not be overwritten.
        RealBenchError: a result or goal set cannot be read.
    """
    stale = _check(folder, overwrite=overwrite)
    _write(folder / MARK, json.dumps({"realbench": __version__}))
    remarks: list[str] = []
    names: dict[tuple[str, str], str] = {}
    pages: dict[str, str] = {}
    for board in boards:
        goals = _goals(board.facts, remarks)
        for row in board.rows:
            name = f"{page_prefix(board.facts.name, row.standing.key)}.html"
            names[board.facts.name, row.standing.key] = name
            shot = folder / FILMS if films else None
            page = Page(name, board, row, tuple(_tests(board.facts, row, goals, shot)))
            pages[name] = _render("submission", page=page)
    pages["index.html"] = _render("index", boards=boards, names=names)
    pages["leaderboard.json"] = json.dumps(json_boards(boards), ensure_ascii=False)
    for name, text in pages.items():
        _write(folder / name, text)
    for page_file in stale - {folder / name for name in pages}:
        page_file.unlink()
    return remarks


def page_prefix(round_name: str, key: str) -> str:
    """What names of a submission's files begin with: neither of the two can hold a ``~``."""
    return f"{round_name}~{key}"


def _check(folder: Path, *, overwrite: bool) -> set[Path]:
    """The pages that a site has already; raises OutputError where it must not be replaced."""
    check_folder(folder, make=True)
    if not any(folder.iterdir()):
        return set()
    if not (folder / MARK).exists():
        raise OutputError(f"{folder} holds other files: use an empty folder")
    if not overwrite:
        raise OutputError(f"{folder} holds a site: use --overwrite, or another --site")
    return set(folder.glob("*.html"))


def _goals(facts: RoundFacts, remarks: list[str]) -> GoalSet | None:
    """The goals of a round, if they may be shown and are there."""
    if facts.hidden:
        remarks.append(
            f"round {facts.name}: its goals are secret, so the site does not show them; once they "
            "are opened, set `released: true` in the round's file and run the round"
        )
        return None
    try:
        goals = load_goal_set(Path(facts.goals))
    except GoalSetError as error:
        remarks.append(f"round {facts.name}: no pictures of its goals: {error}")
        return None
    if goals.sha256 != facts.goals_sha256:
        remarks.append(f"round {facts.name}: no pictures of its goals: {facts.goals} has changed")
        return None
    return goals


def _tests(
    facts: RoundFacts, row: Row, goals: GoalSet | None, films: Path | None
) -> Iterator[tuple[ResultEntry, dict[int, str]]]:
    """What is shown of the goals, trial by trial."""
    if facts.hidden:
        return
    sets = [] if goals is None else [(Path(facts.goals).name, goals)]
    for file, result in zip(row.files, row.results, strict=True):
        names: dict[int, str] = {}
        if films is not None and goals is not None:
            from real_bench.competition.films import film_result

            prefix = f"{page_prefix(facts.name, row.standing.key)}~{file.stem}"
            names = film_result(result, goals, load_scene(facts.scene), films, prefix)
        shown = {goal: f"{FILMS}/{name}" for goal, name in names.items()}
        yield read_tested(file, (), sets), shown


def _render(name: str, **values: object) -> str:
    """A page. All text is escaped."""
    style = packaged_text("real_bench.report", "page.css")
    return render_html(
        packaged_text(__package__, f"{name}.html.jinja"),
        cells=cells,
        headings=headings,
        notes=notes,
        title=title,
        zip=zip,
        style=style + packaged_text(__package__, "site.css"),
        **values,
    )


def _write(path: Path, text: str) -> None:
    write_atomically(path, text.encode())
