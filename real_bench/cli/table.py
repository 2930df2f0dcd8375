"""``realbench table``."""

from __future__ import annotations

import json
import shlex
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from real_bench.cli import options
from real_bench.cli.common import progress_wanted
from real_bench.cli.printing import print_tables, say
from real_bench.errors import ExperimentError, in_short

if TYPE_CHECKING:
    from real_bench.experiments import Spec
    from real_bench.experiments.plan import PendingJobs
    from real_bench.experiments.scheduler import Failure
    from real_bench.experiments.scores import Row

EPILOG = """\b
Example:
  realbench table mine.yaml --init                        # write one to start from
  realbench table mine.yaml                               # run what is missing, print the table
  realbench table evaluation/paper.yaml --format markdown
  realbench table theirs.yaml --isolate --call-limit 600 --total-limit 7200
  realbench table mine.yaml --scheduler tcp://10.0.0.1:8786
"""
FORMATS = ("text", "markdown", "latex")


@click.command(epilog=EPILOG)
@click.argument("spec", type=options.FILE)
@click.option(
    "--init", is_flag=True, help="Write an experiment to start from, with every key explained."
)
@click.option("--run/--no-run", default=None, help="Run what is missing. [default: as SPEC says]")
@options.jobs_at_once_option
@options.scheduler_option
@click.option("--format", "form", type=click.Choice(FORMATS), default="text", show_default=True)
@click.option(
    "--resume",
    is_flag=True,
    help="Continue interrupted plays; otherwise they start over, so that every number is the same.",
)
@options.isolation_options()
@options.overwrite_option
@options.json_option
@click.pass_context
def table(
    context: click.Context,
    /,
    spec: Path,
    init: bool,
    run: bool | None,
    jobs: int | None,
    scheduler: str | None,
    form: str,
    resume: bool,
    isolation: options.Isolation,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Run the experiment SPEC and print its table.

    Works out which plays and tests are missing, runs them, and prints every cell's mean beside the
    published one. Plays that cells share run once. Stop whenever you like (or pull the plug): the
    same command continues, to the same table to the last digit.
    """
    from real_bench.experiments import read_spec
    from real_bench.experiments.running import Experiment
    from real_bench.experiments.scores import rows_of
    from real_bench.progress.jobs import run_jobs
    from real_bench.sandbox import Limits

    if init:
        _write_template(spec, overwrite=overwrite)
        return
    if resume and scheduler:
        raise click.UsageError(
            "--resume continues recordings that are on this machine; jobs of a --scheduler start "
            "over: leave out one of them"
        )
    if as_json and context.get_parameter_source("form") is ParameterSource.COMMANDLINE:
        raise click.UsageError("--json is a format of its own: leave out --format")
    isolation.check()
    limits = Limits(**isolation.limits)
    experiment = Experiment(read_spec(spec), jobs, scheduler, isolation.isolate, limits)
    wanted = experiment.spec.run if run is None else run
    if isolation.isolate:
        options.print_isolation()
    failures: dict[str, Failure] = {}
    if wanted:
        with experiment.lock_folder():
            experiment.prepare(overwrite=overwrite)
            work = experiment.missing(resume=resume, overwrite=overwrite)
            if len(work):
                experiment.check(work)
                make = partial(experiment.make, work)
                failures = run_jobs(work, make, shown=progress_wanted())
    plan = experiment.plan()
    _show(experiment.spec, rows_of(experiment.spec, plan), "json" if as_json else form)
    if failures:
        raise ExperimentError(in_short([failure.detail for failure in failures.values()]))
    if not wanted:
        _print_missing(plan.pending(), spec)


def _write_template(spec: Path, *, overwrite: bool) -> None:
    """Write an experiment to start from."""
    from real_bench.experiments.spec import write_template

    write_template(spec, overwrite=overwrite)
    say(f"{spec}: an experiment to start from; run it with `{_command(spec)}`")


def _command(spec: Path) -> str:
    """What makes the table, for a shell."""
    return shlex.join(["realbench", "table", str(spec)])


def _show(spec: Spec, rows: list[Row], form: str) -> None:
    """Print the table."""
    from real_bench.experiments import table as tables

    if form == "json":
        say(json.dumps(tables.json_table(spec, rows)))
    elif form == "text":
        print_tables(tables.text_table(spec, rows))
    else:
        draw = {"markdown": tables.markdown_table, "latex": tables.latex_table}[form]
        say(draw(spec, rows))


def _print_missing(work: PendingJobs, spec: Path) -> None:
    if len(work):
        say(
            f"missing: {work}; run them with `{_command(spec)} --run`",
            err=True,
        )
