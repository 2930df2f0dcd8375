"""Run jobs with progress shown."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from real_bench.cli.printing import say

if TYPE_CHECKING:
    from real_bench.experiments.plan import PendingJobs
    from real_bench.experiments.scheduler import ExperimentProgress

NAMES_SHOWN = 2

T = TypeVar("T")


def with_progress(
    work: PendingJobs, make: Callable[[Callable[[ExperimentProgress], None]], T]
) -> T:
    """What ``make`` returns; it is called with a function that shows the jobs' progress."""
    from real_bench.cli.progress import ProgressDisplay

    say(f"to run: {work}", err=True)
    with ProgressDisplay("simulating", "steps", work.n_steps) as display:

        def update(progress: ExperimentProgress) -> None:
            now = ", ".join(progress.running[:NAMES_SHOWN])
            more = len(progress.running) - NAMES_SHOWN
            doing = f"now {now}{f' and {more} more' if more > 0 else ''}"
            if progress.waiting_for:
                doing = f"waiting for {progress.waiting_for}"
            note = f"{progress.n_jobs} of {len(work)} jobs done, {doing}"
            display.update(progress.n_steps, note)

        return make(update)
