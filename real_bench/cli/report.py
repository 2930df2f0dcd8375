"""``realbench report``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from real_bench.cli import kinds, options
from real_bench.cli.printing import say

if TYPE_CHECKING:
    from real_bench.goal_sets import GoalSet
    from real_bench.report import Chart, Report, Table, Tested

EPILOG = """\b
Example:
  realbench report run.h5 score.json --videos videos --out report.html
  realbench report evaluation/paper.yaml om0.h5 real_d-OM-1-seed0-a.json --goals a.npy
"""


@click.command(epilog=EPILOG)
@click.argument("files", type=options.FILE, nargs=-1, required=True)
@click.option("--out", type=options.FILE, default="report.html", show_default=True)
@click.option("--title", default="REAL benchmark report", show_default=True)
@click.option(
    "--goals",
    type=options.FILE,
    multiple=True,
    help="A goal set that was tested, for its pictures; may be repeated. [default: the shipped]",
)
@click.option(
    "--videos", type=options.FILE, metavar="DIR", help="Films of the trials of the only result."
)
@options.overwrite_option
def report(
    files: tuple[Path, ...],
    out: Path,
    title: str,
    goals: tuple[Path, ...],
    videos: Path | None,
    overwrite: bool,
) -> None:
    """Make one HTML file that shows what was done, and works offline and on a phone.

    FILES are experiments (.yaml), of which the table is shown; results (.json), of which every goal
    is shown with start, goal and end; and recordings (.h5). All figures are drawn for which they
    have the data.
    """
    from real_bench.files import check_output
    from real_bench.report import write_report

    check_output(out, overwrite=overwrite)
    made = _report(files, title, goals, videos)
    write_report(made, out)
    for remark in made.remarks:
        say(f"realbench: {remark}", err=True)
    say(f"report: {out}")


def _report(
    files: Sequence[Path], title: str, goals: Sequence[Path], videos: Path | None
) -> Report:
    from real_bench.cli.progress import ProgressDisplay
    from real_bench.report import Report, read_played, read_tested

    sorted_files = kinds.by_kind(files, kinds.EXPERIMENT, kinds.RECORDING, kinds.RESULT)
    recordings, results = sorted_files[kinds.RECORDING], sorted_files[kinds.RESULT]
    if videos is not None and len(results) != 1:
        raise click.UsageError(f"--videos are of one result, not of {len(results)}")
    tables = [_table(path) for path in sorted_files[kinds.EXPERIMENT]]
    plays = [read_played(path) for path in recordings]
    sets = _goal_sets(goals, results)
    tests: list[Tested] = []
    with ProgressDisplay("picturing results", "results", len(results)) as display:
        for number, path in enumerate(results):
            display.update(number, path.name)
            tests.append(read_tested(path, plays, sets, videos))
    charts, remarks = _charts(recordings, results)
    return Report(title, tables, plays, tests, charts, [*remarks, *_lacking(tests)])


def _table(path: Path) -> Table:
    from real_bench.experiments import read_spec
    from real_bench.experiments.agenda import Agenda
    from real_bench.experiments.scores import rows_of
    from real_bench.experiments.table import HEADINGS, cells, notes
    from real_bench.report import Table

    spec = read_spec(path)
    rows = rows_of(spec, Agenda(spec))
    return Table(
        title=spec.title,
        headings=HEADINGS,
        rows=tuple(tuple(cells(row)) for row in rows),
        notes=tuple(notes(rows)),
        command=f"realbench table {path}",
    )


def _goal_sets(files: Sequence[Path], results: Sequence[Path]) -> list[tuple[str | None, GoalSet]]:
    """The goal sets that results may be of, and how the command line names them."""
    from real_bench.errors import GoalSetError
    from real_bench.goal_sets import load_goal_set, shipped_goal_set
    from real_bench.scoring.result import load_result

    found: list[tuple[str | None, GoalSet]] = [(str(file), load_goal_set(file)) for file in files]
    for objects in sorted({load_result(path).setting.objects for path in results}):
        try:
            found.append((None, load_goal_set(shipped_goal_set(objects))))
        except GoalSetError:
            continue
    return found


def _charts(recordings: Sequence[Path], results: Sequence[Path]) -> tuple[list[Chart], list[str]]:
    """The figures that can be drawn, and what is to be said of those that cannot."""
    from real_bench.cli.figures import read_material
    from real_bench.errors import ResultError
    from real_bench.figures import FIGURES, Asked
    from real_bench.report import Chart, data_uri

    remarks: list[str] = []
    try:
        material = read_material(recordings, results, Asked())
    except ResultError as error:
        remarks.append(f"no figures of scores: {error}")
        material = read_material(recordings, [], Asked())
    charts = [
        Chart(
            name=kind.name,
            shows=kind.shows,
            width_cm=drawing.width_cm,
            svg=data_uri(drawing.svg(), "image/svg+xml"),
            csv=data_uri(drawing.numbers.csv(), "text/csv"),
        )
        for kind in FIGURES
        if (drawing := kind.draw(material)) is not None
    ]
    return charts, remarks


def _lacking(tests: Sequence[Tested]) -> list[str]:
    """What pictures there are not, and how to have them."""
    told = []
    for test in tests:
        if test.trials[0].goal is None:
            told.append(f"{test.file}: no pictures of its goals; name its goal set with --goals")
        if test.trials[0].end is None:
            scene = test.result.setting.scene
            told.append(f"{test.file}: no pictures of its ends; scene {scene} is not as it was")
    return told
