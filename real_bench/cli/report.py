"""``realbench report``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from real_bench.cli import kinds, options
from real_bench.cli.common import progress_display
from real_bench.cli.printing import say

if TYPE_CHECKING:
    from real_bench.report import Report

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
    help="Goal set of the results, for pictures; may be repeated. [default: the shipped ones]",
)
@click.option(
    "--videos",
    type=options.FILE,
    metavar="DIR",
    help="Folder with films of the trials, if there is one result.",
)
@options.scene_option
@click.option("--released", is_flag=True, help="Show secret goals.")
@options.overwrite_option
def report(
    files: tuple[Path, ...],
    out: Path,
    title: str,
    goals: tuple[Path, ...],
    videos: Path | None,
    scene: str | None,
    released: bool,
    overwrite: bool,
) -> None:
    """Write one HTML file that shows what was done; it works offline and on a phone.

    FILES are experiments (.yaml), shown as a table; results (.json), shown with start, goal and end
    of every trial; and recordings (.h5). Every figure whose data they hold is drawn.
    """
    from real_bench.files.kinds import REPORT
    from real_bench.files.outputs import check_output
    from real_bench.report import write_report

    check_output(out, overwrite=overwrite, kind=REPORT)
    made = _make_report(files, title, goals, videos, scene, released=released)
    write_report(made, out)
    for remark in made.remarks:
        say(f"realbench: {remark}", err=True)
    say(f"report: {out}")


def _make_report(
    files: Sequence[Path],
    title: str,
    goals: Sequence[Path],
    videos: Path | None,
    scene: str | None,
    *,
    released: bool,
) -> Report:
    from real_bench.report.making import ReportFiles, make_report

    found = kinds.by_kind(files, kinds.EXPERIMENT, kinds.RECORDING, kinds.RESULT)
    sources = ReportFiles(
        found[kinds.EXPERIMENT],
        found[kinds.RECORDING],
        found[kinds.RESULT],
        goals,
        videos,
        released,
        scene,
    )
    with progress_display("picturing results", "results", len(sources.results)) as display:
        return make_report(sources, title, display.update)
