"""Play and tests, run with progress shown.

What a controller prints goes to standard error meanwhile; standard output is for results.
"""

from __future__ import annotations

import contextlib
import sys
from typing import TYPE_CHECKING

from real_bench.progress.display import ProgressDisplay

if TYPE_CHECKING:
    from real_bench.phases.extrinsic import ExtrinsicPhase
    from real_bench.phases.intrinsic import IntrinsicPhase, Progress
    from real_bench.phases.proxy import ControllerProxy
    from real_bench.scoring.result import Result


def play(
    phase: IntrinsicPhase, *, resume: bool, overwrite: bool, shown: bool = True
) -> ControllerProxy:
    """Run the phase with progress shown."""
    with ProgressDisplay(
        f"playing {phase.controller}", "steps", phase.steps, shown=shown
    ) as display:

        def report(progress: Progress) -> None:
            moved = progress.n_moved / progress.n_actions
            rate = display.rate(progress.n_steps)
            display.update(
                progress.n_steps, f"{rate:,.0f} steps/s, {moved:.0%} of actions moved an object"
            )

        with contextlib.redirect_stdout(sys.stderr):
            return phase.run(report, resume=resume, overwrite=overwrite, activity=display.activity)


def run_trials(
    phase: ExtrinsicPhase,
    *,
    resume: bool,
    overwrite: bool,
    proxy: ControllerProxy | None = None,
    shown: bool = True,
) -> Result:
    """Run the phase with progress shown."""
    title = f"testing {phase.plan.controller}"
    with ProgressDisplay(title, "goals", phase.n_trials, shown=shown) as display:

        def report(result: Result) -> None:
            display.update(len(result.trials), f"score {result.score:.3f}")

        with contextlib.redirect_stdout(sys.stderr):
            return phase.run(
                report,
                resume=resume,
                overwrite=overwrite,
                proxy=proxy,
                activity=display.activity,
            )
