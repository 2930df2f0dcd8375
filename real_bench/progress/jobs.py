"""The jobs of an experiment or a round, run with progress shown."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

import click

from real_bench.progress.display import ProgressDisplay
from real_bench.text.quoting import printable

if TYPE_CHECKING:
    from real_bench.experiments.plan import PendingJobs
    from real_bench.experiments.scheduler import ExperimentProgress

NAMES_SHOWN = 2

T = TypeVar("T")


def run_jobs(
    work: PendingJobs,
    make: Callable[[Callable[[ExperimentProgress], None]], T],
    *,
    shown: bool = True,
) -> T:
    """What ``make`` returns; it is called with a function that shows the jobs' progress."""
    click.echo(f"to run: {printable(str(work))}", err=True)
    with ProgressDisplay("simulating", "steps", work.n_steps, shown=shown) as display:

        def update(progress: ExperimentProgress) -> None:
            now = ", ".join(progress.running[:NAMES_SHOWN])
            more = len(progress.running) - NAMES_SHOWN
            doing = f"now {now}{f' and {more} more' if more > 0 else ''}"
            if progress.waiting_for:
                doing = f"waiting for {progress.waiting_for}"
            note = f"{progress.n_jobs} of {len(work)} jobs done, {doing}"
            display.update(progress.n_steps, note)

        return make(update)
