"""``realbench evaluate``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from real_bench.cli import options, running
from real_bench.cli.common import progress_wanted
from real_bench.files import defaults
from real_bench.lengths import INTRINSIC_STEPS

EPILOG = """\b
Example:
  realbench evaluate --controller my_controller.py --condition IM --steps 100000 --trials 5
"""


@click.command(epilog=EPILOG)
@options.setting_options
@click.option("--steps", type=int, help=f"Length of the play. [default: {INTRINSIC_STEPS:,}]")
@options.goals_option
@options.trials_option
@options.trial_steps_option
@click.option(
    "--run",
    type=options.FILE,
    default=defaults.RUN,
    show_default=True,
    help="The recording of the play, to be written.",
)
@options.result_option
@click.option(
    "--overwrite",
    is_flag=True,
    help="Replace the result if it exists, and the recording if --run names it.",
)
@options.json_option
@options.isolation_options()
@click.pass_context
def evaluate(
    context: click.Context,
    /,
    goals: Path | None,
    trials: int | None,
    trial_steps: int,
    run: Path,
    out: Path,
    overwrite: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """Play and test in one process with one controller; each trial gets a copy of it.

    For controllers that keep what they learn in memory, as in the official evaluation. One that
    keeps learning from trial to trial sets learns_across_trials. For a controller with get_state()
    and set_state(), use intrinsic and extrinsic instead.
    """
    from real_bench.errors import Interrupted
    from real_bench.files.kinds import RECORDING, RESULT
    from real_bench.files.outputs import check_output
    from real_bench.phases.extrinsic import ExtrinsicPhase
    from real_bench.phases.plans import plan_test_after, resume_command
    from real_bench.progress.phases import play, run_trials

    is_named = context.get_parameter_source("run") is ParameterSource.COMMANDLINE
    if overwrite and not is_named and run.exists():
        raise click.UsageError(
            f"{run} exists, and --overwrite replaces it only if it is named: add --run {run}"
        )
    phase = running.plan_from_options(run, secrets=[out, goals], **given)
    plan = plan_test_after(phase, goals, trial_steps)
    test = ExtrinsicPhase(plan, running.n_trials_requested(trials, plan, allow_part=True), out)
    check_output(run, overwrite=overwrite, kind=RECORDING, instead="another --run")
    check_output(out, overwrite=overwrite, kind=RESULT)
    try:
        proxy = play(phase, resume=False, overwrite=overwrite, shown=progress_wanted())
    except Interrupted as stop:
        if not stop.can_resume:
            raise
        raise Interrupted(
            f"{stop} in {run}; the controller was in memory: if it has get_state() or "
            f"use_experience(), go on with `{resume_command(run)}`"
        ) from stop
    result = run_trials(
        test, resume=False, overwrite=overwrite, proxy=proxy, shown=progress_wanted()
    )
    running.show_result(result, out, as_json=as_json)
