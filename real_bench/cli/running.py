"""Plan phases from a command's options, run them, and print what came out."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from real_bench.cli import options
from real_bench.cli.common import progress_wanted
from real_bench.cli.printing import print_tables, say
from real_bench.files import defaults
from real_bench.text.counting import counted

if TYPE_CHECKING:
    from real_bench.phases.handover import Wanted
    from real_bench.phases.intrinsic import IntrinsicPhase
    from real_bench.phases.trial import TrialPlan
    from real_bench.scoring.result import Result


def plan_from_options(
    out: Path,
    *,
    settings_file: Path | None,
    assignments: tuple[str, ...],
    isolation: options.Isolation,
    secrets: Iterable[Path | None] = (),
    resume: bool = False,
    **given: Any,
) -> IntrinsicPhase:
    """The play that the options ask for.

    An isolated controller must not be able to read the recording or ``secrets``.
    """
    from real_bench.phases.plans import plan_play
    from real_bench.settings import read_settings

    settings = read_settings(settings_file, assignments)
    backend = isolation.backend([out, *secrets])
    return plan_play(out, resume=resume, settings=settings, backend=backend, **given)


def run_test(
    *,
    trials: int | None,
    allow_part: bool,
    jobs: int,
    out: Path,
    isolation: options.Isolation,
    resume: bool,
    overwrite: bool,
    settings_file: Path | None,
    assignments: tuple[str, ...],
    run: Path | None,
    goals: Path | None,
    learned: Wanted | None,
    video: Path | None = None,
    pictures: Path | None = None,
    explain: Path | None = None,
    secrets: Iterable[Path | None] = (),
    check: Callable[[TrialPlan], None] = lambda plan: None,
    **given: Any,
) -> Result:
    """The result of the test that the options ask for; progress is shown.

    An isolated controller must not be able to read any file of the test or ``secrets``. ``check``
    may refuse what is planned.
    """
    from real_bench.phases.extrinsic import ExtrinsicPhase
    from real_bench.phases.plans import plan_test
    from real_bench.progress.phases import run_trials
    from real_bench.settings import read_settings

    files = [run, defaults.existing_run(), goals, video, pictures, explain]
    written = [path for path in (out, *files, *secrets) if path is not None]
    plan = plan_test(
        run=run,
        goals=goals,
        settings=read_settings(settings_file, assignments),
        backend=isolation.backend(written),
        videos=video,
        pictures=pictures,
        explanations=explain,
        wanted=learned,
        **given,
    )
    check(plan)
    phase = ExtrinsicPhase(plan, n_trials_requested(trials, plan, allow_part=allow_part), out, jobs)
    return run_trials(phase, resume=resume, overwrite=overwrite, shown=progress_wanted())


def n_trials_requested(trials: int | None, plan: TrialPlan, *, allow_part: bool) -> int:
    """How many goals to test: ``trials``, or all if None.

    Raises UsageError if only a part would be judged without ``allow_part``.
    """
    whole = len(plan.goal_set)
    if trials is not None and 0 < trials < whole and not allow_part:
        raise click.UsageError(
            f"--trials {trials} tests only a part of the {counted(whole, 'goal')}: "
            "add --allow-part to judge it"
        )
    return whole if trials is None else trials


def show_result(result: Result, out: Path, *, as_json: bool) -> None:
    """Print the score table, or the result and its scores as JSON."""
    from real_bench.scoring.summary import summary_json

    if as_json:
        say(json.dumps({**result.to_json(), "summary": summary_json(result)}))
        return
    from real_bench.scoring.table import score_table

    print_tables(score_table(result))
    say(f"result: {out}")
