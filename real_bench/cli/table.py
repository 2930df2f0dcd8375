"""``realbench table``."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from real_bench.cli import options
from real_bench.cli.printing import print_tables, say
from real_bench.errors import ExperimentError, Interrupted

if TYPE_CHECKING:
    from real_bench.experiments import Spec
    from real_bench.experiments.agenda import Work
    from real_bench.experiments.crew import Crew
    from real_bench.experiments.scores import Row

EPILOG = """\b
Example:
  realbench table evaluation/smoke.yaml                   # the whole chain in some minutes
  realbench table evaluation/paper.yaml --format markdown
  realbench table mine.yaml --scheduler tcp://10.0.0.1:8786
"""
FORMATS = ("text", "markdown", "latex")
NAMES_SHOWN = 2


@click.command(epilog=EPILOG)
@click.argument("spec", type=options.FILE)
@click.option(
    "--run/--no-run", default=None, help="Make what is missing. [default: as the SPEC says]"
)
@click.option("--jobs", type=click.IntRange(min=1), help="Tasks at once. [default: one a core]")
@click.option("--scheduler", metavar="ADDRESS", help="Do the tasks on this Dask cluster.")
@click.option("--format", "form", type=click.Choice(FORMATS), default="text", show_default=True)
@click.option(
    "--resume",
    is_flag=True,
    help="Go on with plays that were cut; else they begin anew, so that every number is the same.",
)
@options.isolate_option()
@options.overwrite_option
@options.json_option
def table(
    spec: Path,
    run: bool | None,
    jobs: int | None,
    scheduler: str | None,
    form: str,
    resume: bool,
    isolate: bool,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Make the table that the experiment SPEC describes.

    Works out which plays and tests are missing, makes them, and prints every cell's mean beside
    the published one. Plays that cells share are made once. Stop it whenever you like (or pull the
    plug): the same command goes on, and ends in the same table to the last digit.
    """
    from real_bench.experiments import read_spec
    from real_bench.experiments.agenda import Agenda
    from real_bench.experiments.scores import rows_of
    from real_bench.experiments.state import in_short

    experiment = read_spec(spec)
    wanted = experiment.run if run is None else run
    if isolate:
        options.tell_walls()
    failures: dict[str, str] = {}
    if wanted:
        with _own_folder(experiment):
            _check_controllers(experiment, isolate)
            _draw_goals(experiment)
            _check_goals(experiment)
            work = Agenda(experiment, isolate=isolate).left(go_on=resume, overwrite=overwrite)
            if len(work):
                failures = _make(work, _crew(experiment, jobs, scheduler))
    agenda = Agenda(experiment, isolate=isolate)
    _show(experiment, rows_of(experiment, agenda), "json" if as_json else form)
    if failures:
        raise ExperimentError(in_short(list(failures.values())))
    if not wanted:
        _tell_missing(agenda.left(), spec)


@contextlib.contextmanager
def _own_folder(spec: Spec) -> Iterator[None]:
    """The experiment's folder, in which no other process makes the same."""
    from real_bench.files import OutputError
    from real_bench.locks import write_lock

    folder = spec.results_folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder {folder}: {error.strerror}") from error
    with write_lock(folder / "table"):
        yield


def _draw_goals(spec: Spec) -> None:
    """Draw the goals that are missing."""
    from real_bench.experiments.agenda import Agenda
    from real_bench.simulation import load_scene

    load_scene(spec.scene_source)  # whether it is installed
    for name in Agenda(spec).draw_goals():
        say(f"drawing {name}", err=True)


def _check_controllers(spec: Spec, isolate: bool) -> None:
    """Find out before any work is done whether controllers are there, and take their settings."""
    from real_bench.experiments.agenda import Agenda
    from real_bench.source import ControllerSource

    played = [found[1].controller for cell in spec.cells if (found := spec.play_of(cell))]
    for named in {*played, *(cell.controller for cell in spec.cells)}:
        ControllerSource.of(spec.controller(named)).code_files()
    Agenda(spec, isolate=isolate).check_settings()


def _check_goals(spec: Spec) -> None:
    """Find out before any work is done whether goals fit."""
    from real_bench.goal_sets import load_goal_set
    from real_bench.simulation import load_scene

    scene = load_scene(spec.scene_source)
    goals = {(name, cell.objects) for cell in spec.cells for name in spec.goal_names(cell)}
    for name, objects in sorted(goals):
        load_goal_set(spec.goal_file(name, objects)).check_fits(scene, objects)


def _crew(spec: Spec, jobs: int | None, scheduler: str | None) -> Crew:
    """Who does the tasks: processes here, or a cluster."""
    from real_bench.experiments.crew import Crew
    from real_bench.experiments.process import Processes

    if scheduler is None:
        return Crew(Processes(spec.results_folder / "logs"), jobs or os.cpu_count() or 1)
    from real_bench.experiments.cluster import AT_ONCE, Cluster

    return Crew(Cluster(scheduler), jobs or AT_ONCE)


def _make(work: Work, crew: Crew) -> dict[str, str]:
    """Have the work done, with progress shown; gives why tasks were not done, by name."""
    from real_bench.cli.progress import ProgressDisplay
    from real_bench.experiments.crew import Standing

    say(
        f"{len(work.plays)} plays and {len(work.scorings)} tests to do, "
        f"{work.n_steps:,} steps in all",
        err=True,
    )
    with ProgressDisplay("simulating", "steps", work.n_steps) as display:

        def update(standing: Standing) -> None:
            now = ", ".join(standing.running[:NAMES_SHOWN])
            more = len(standing.running) - NAMES_SHOWN
            doing = f"now {now}{f' and {more} more' if more > 0 else ''}"
            if standing.waits_for:
                doing = f"waiting for {standing.waits_for}"
            told = f"{standing.n_tasks} of {len(work)} tasks done, {doing}"
            display.update(standing.n_steps, told)

        try:
            return crew.do(work, update)
        except KeyboardInterrupt as error:
            raise Interrupted(
                "stopped; what is finished is kept: repeat the command to go on"
            ) from error


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


def _tell_missing(work: Work, spec: Path) -> None:
    if len(work):
        say(
            f"not made: {len(work.plays)} plays and {len(work.scorings)} tests, {work.n_steps:,} "
            f"steps in all; `realbench table {spec} --run` makes them",
            err=True,
        )
