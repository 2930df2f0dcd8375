"""``realbench round``."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from real_bench.cli import options
from real_bench.cli.common import HelpfulGroup, progress_wanted
from real_bench.cli.outputs import junit_output
from real_bench.cli.printing import print_tables, say

if TYPE_CHECKING:
    from real_bench.competition.spec import Competition, Round
    from real_bench.competition.standing import Standing
    from real_bench.experiments.scheduler import Failure

BROKEN = 1

EPILOG = """\b
Example:
  realbench round run submissions/ round.yaml --jobs 4
  realbench leaderboard results/ --site site
"""
RUN_EPILOG = """\b
Example:
  realbench goals generate --secret --out secret.npy
  realbench round run submissions/ round.yaml --jobs 4
  realbench round run submissions/ round.yaml --round final --scheduler tcp://10.0.0.1:8786

\b
Exit code: 0 every submission is finished, scored or not; 1, 2 the job is broken; 130 stopped.
Each submission's outcome is in its status, and in --junit: a failure if it was refused, an
error if it failed.
"""
CODABENCH_EPILOG = """\b
Example:
  docker build --target platform --tag me/realbench:1 . && docker push me/realbench:1
  realbench round codabench round.yaml --image me/realbench:1 --out bundle.zip
"""


@click.group(cls=HelpfulGroup, epilog=EPILOG)
def round() -> None:
    """Hold the rounds of a competition, described in one YAML file (docs/competition.md)."""


@round.command(epilog=RUN_EPILOG)
@click.argument("submissions", type=options.FILE)
@click.argument("spec", type=options.FILE)
@options.round_option
@options.jobs_at_once_option
@options.scheduler_option
@click.option("--retry", is_flag=True, help="Retry what failed.")
@click.option("--junit", type=options.FILE, help="Write each submission's outcome as JUnit XML.")
@options.overwrite_option
@click.pass_context
def run(
    context: click.Context,
    submissions: Path,
    spec: Path,
    name: str | None,
    jobs: int | None,
    scheduler: str | None,
    retry: bool,
    junit: Path | None,
    overwrite: bool,
) -> None:
    """Play and test all SUBMISSIONS, folders or archives in a folder.

    Every submission runs isolated, within the round's limits; none can stop the others. Only what
    is missing is run: stop whenever you like (or pull the plug), and the same command continues,
    to the same leaderboard.
    """
    from real_bench.competition.junit import standings_report
    from real_bench.competition.running import RoundRun
    from real_bench.competition.spec import read_competition
    from real_bench.errors import in_short
    from real_bench.progress.jobs import run_jobs

    cases = junit_output(context, junit, overwrite=overwrite)
    competition = read_competition(spec)
    if name is not None and name not in competition.rounds:
        known = ", ".join(competition.rounds)
        raise click.UsageError(f"{spec} has no round {name}: use {known}")
    _check_apart(competition, submissions)
    options.print_isolation()
    standings_by_round: dict[str, list[Standing]] = {}
    broken: dict[str, Failure] = {}
    began = time.monotonic()
    for each in competition.rounds if name is None else [name]:
        _warn_if_over(competition.rounds[each], each)
        round_run = RoundRun(competition, each, submissions, jobs, scheduler)
        run_shown = partial(run_jobs, shown=progress_wanted())
        standings, failures = round_run.hold(run_shown, retry=retry, overwrite=overwrite)
        standings_by_round[each] = standings
        broken |= failures
        _show(round_run.folder)
        if n_failed := sum(bool(standing.failures) for standing in standings):
            _tell_of_failures(n_failed, round_run.folder, retry=retry)
    if cases is not None:
        cases.write(standings_report(standings_by_round, time.monotonic() - began).tostring())
    reasons = [failure.detail for failure in broken.values()] or _waits(standings_by_round)
    if reasons:
        told = f"through no fault of a submission: {in_short(reasons)}; repeat the command"
        say(f"realbench: {told}", err=True)
        sys.exit(BROKEN)


def _check_apart(competition: Competition, submissions: Path) -> None:
    """Refuse a folder of submissions that is that of a round's results."""
    for each in competition.rounds:
        if (competition.results_folder / each).resolve() == submissions.resolve():
            raise click.UsageError(f"{submissions} is the folder of round {each}: rename one")


def _warn_if_over(held: Round, name: str) -> None:
    if held.is_over:
        told = (
            f"round {name} ended at {held.end} (UTC); submissions that came later are ranked, "
            "too: move them away if they are not to be"
        )
        say(f"realbench: {told}", err=True)


def _waits(standings_by_round: Mapping[str, Sequence[Standing]]) -> list[str]:
    """Why submissions wait, a line each."""
    from real_bench.competition.standing import WAITING

    return [
        f"{standing.name} waits: {standing.detail}"
        for standings in standings_by_round.values()
        for standing in standings
        if standing.status == WAITING
    ]


def _show(folder: Path) -> None:
    from real_bench.competition.leaderboard import read_leaderboards, text_table

    print_tables(*map(text_table, read_leaderboards(folder)))


def _tell_of_failures(n_failed: int, folder: Path, *, retry: bool) -> None:
    from real_bench.competition.round_file import load_round
    from real_bench.text.counting import counted

    if not retry:
        failed = counted(n_failed, "submission")
        say(f"{failed} failed, and will not be run again without --retry")
    if load_round(folder).hidden:
        say(f"why they failed: {folder}/*/standing.json (for you alone: it may tell of the goals)")


@round.command(epilog=CODABENCH_EPILOG)
@click.argument("spec", type=options.FILE)
@click.option(
    "--out", type=options.FILE, default="bundle.zip", show_default=True, help="The bundle to write."
)
@click.option(
    "--image",
    default="realbench:platform",
    show_default=True,
    metavar="NAME",
    help="Image built from our Dockerfile (target platform), as the platform can pull it.",
)
@options.overwrite_option
def codabench(spec: Path, out: Path, image: str, overwrite: bool) -> None:
    """Write the rounds as a bundle to upload to Codabench.

    Each round is a phase with a task: its ingestion program plays and tests a submission, isolated,
    and its scoring program replays every trial. The bundle holds the goals: keep it secret.
    """
    from real_bench.competition.codabench import write_bundle
    from real_bench.competition.spec import read_competition
    from real_bench.files.kinds import ARCHIVE
    from real_bench.files.outputs import check_output

    check_output(out, overwrite=overwrite, kind=ARCHIVE)
    for name in write_bundle(read_competition(spec), out, image):
        say(f"  {name}")
    say(f"{out}: holds the goals; keep it secret")
