"""``realbench submission``."""

from __future__ import annotations

import contextlib
import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from real_bench.cli import options
from real_bench.cli.common import HelpfulGroup
from real_bench.cli.outputs import junit_output
from real_bench.cli.printing import say, warnings_only
from real_bench.text.counting import counted

if TYPE_CHECKING:
    from real_bench.competition.spec import Play
    from real_bench.phases.checking import Finding

BAD = 3

EPILOG = """\b
Example:
  realbench submission init mine --name "Push and see" --author "A. Turing"
  realbench submission check mine
  realbench submission pack mine --out mine.zip
"""
CHECK_EPILOG = """\b
Example:
  realbench submission check mine.zip --junit junit.xml
  realbench submission check mine --play none

\b
Exit code: 0 it passes; 3 it does not; 1, 2 it could not be checked.
"""


@click.group(cls=HelpfulGroup, epilog=EPILOG)
def submission() -> None:
    """Create, check and pack a submission: a folder with submission.yaml and a controller."""


@submission.command(epilog=EPILOG)
@click.argument("folder", type=options.FILE)
@click.option("--name", help="Name on the leaderboard. [default: the folder's name]")
@click.option("--author", default="Somebody", show_default=True)
@click.option("--condition", default="OM", show_default=True, metavar="XY")
def init(folder: Path, name: str | None, author: str, condition: str) -> None:
    """Create a submission to start from; it runs as it is."""
    from real_bench.competition.template import make_template

    make_template(folder, name or folder.resolve().name, author, condition)
    say(f"{folder}: submission.yaml and controller.py; try `realbench submission check {folder}`")


@submission.command(epilog=CHECK_EPILOG)
@click.argument("place", type=options.FILE)
@click.option("--objects", type=click.IntRange(min=1), default=1, show_default=True)
@click.option(
    "--play",
    type=click.Choice(["own", "given", "none"]),
    default="own",
    show_default=True,
    help="Of the round that it is made for: after its own play it must hand over what it learned.",
)
@options.limit_options
@options.junit_option
@options.overwrite_option
@options.json_option
@click.pass_context
def check(
    context: click.Context,
    place: Path,
    objects: int,
    play: Play,
    limits: dict[str, float],
    junit: Path | None,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Check a submission, a folder or a zip; its code runs isolated.

    Reads submission.yaml, installs the requirements, and lets the controller load, play some
    steps, be copied, hand over its state, and learn from such a play and try a goal.
    """
    from real_bench.competition.checking import SubmissionCheck
    from real_bench.controller_code.packing import open_submission
    from real_bench.errors import SubmissionError
    from real_bench.files.locks import temporary_folder
    from real_bench.phases.checking import Finding
    from real_bench.sandbox import Limits

    if not place.exists():
        raise click.UsageError(f"submission not found: {place}")
    cases = junit_output(context, junit, overwrite=overwrite)
    began = time.monotonic()
    options.print_isolation()
    with temporary_folder("realbench-submission-") as folder:
        try:
            found = open_submission(place, folder / "submission")
        except SubmissionError as error:
            findings = [Finding("fails", False, str(error))]
        else:
            with contextlib.redirect_stdout(sys.stderr), warnings_only():
                made = SubmissionCheck(found, objects, Limits(**limits), play)
                findings = list(made.findings())
    good = all(finding.good for finding in findings)
    if cases is not None:
        from real_bench.competition.junit import checks_report

        cases.write(checks_report(str(place), findings, time.monotonic() - began).tostring())
    _show(findings, good, as_json=as_json)
    if not good:
        sys.exit(BAD)


@submission.command(epilog=EPILOG)
@click.argument("folder", type=options.FILE)
@click.option("--out", type=options.FILE, help="The archive. [default: FOLDER.zip]")
@options.overwrite_option
def pack(folder: Path, out: Path | None, overwrite: bool) -> None:
    """Pack a submission into one archive, without recordings, results and caches.

    The same files give the same archive.
    """
    from real_bench.controller_code.packing import pack as pack_submission
    from real_bench.controller_code.source import ControllerSource
    from real_bench.files.atomic import real_path
    from real_bench.files.kinds import ARCHIVE
    from real_bench.files.outputs import check_output

    place = folder.resolve()
    archive = out or place.with_name(f"{place.name}.zip")
    if real_path(archive).is_relative_to(place):
        raise click.UsageError(f"{archive} is in the folder that is packed: give another --out")
    check_output(archive, overwrite=overwrite, kind=ARCHIVE)
    files = pack_submission(folder, archive)
    for file in files:
        say(f"  {file.relative_to(place)}")
    sha256 = ControllerSource.of(str(place)).code_sha256
    say(f"{archive}: {counted(len(files), 'file')}, hash {sha256}")


def _show(findings: list[Finding], good: bool, *, as_json: bool) -> None:
    if as_json:
        say(json.dumps({"good": good, "findings": [asdict(finding) for finding in findings]}))
        return
    for finding in findings:
        say(f"{'ok' if finding.good else 'NO':3} {finding.what:9} {finding.detail}")
