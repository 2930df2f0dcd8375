"""``realbench score``."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from real_bench.cli import options, running
from real_bench.cli.outputs import junit_output
from real_bench.cli.printing import say
from real_bench.errors import ControllerError
from real_bench.files import defaults
from real_bench.files.output_streams import Output

if TYPE_CHECKING:
    from junitparser import JUnitXml

    from real_bench.phases.trial import TrialPlan
    from real_bench.scoring.result import Result

EPILOG = """\b
Example:
  realbench score --controller submission/mine.py --run run.h5 --goals secret.npy --min 0.2 \\
      --junit junit.xml --markdown "$GITHUB_STEP_SUMMARY"
  realbench score score.json --min 0.2
  realbench score 'results/*.json' --baseline best.json --goals goals.npy

\b
Exit code: 0 passed; 3 bad submission: a check fails, or it cannot be loaded; 4 the controller
failed: it raised an error, took too much time or memory, or broke a rule; 1, 2 the job is
broken. In JUnit XML, 3 is a failure and 4 an error; a broken job writes none.
"""

NOT_PASSED = 3
OF_BOTH = (
    *("files", "minimum", "baseline", "goals", "allow_part"),
    *("markdown", "junit", "overwrite", "as_json"),
)


@click.command(epilog=EPILOG)
@click.argument("files", nargs=-1)
@click.option(
    "--min", "minimum", type=float, metavar="X", help="The lowest mean score that passes."
)
@click.option(
    "--baseline",
    metavar="FILE",
    help="Results on the same goals; these must not be worse beyond chance.",
)
@click.option("--markdown", type=options.FILE, help="Append a summary to this file.")
@options.junit_option
@options.allow_part_option
@options.setting_options
@options.testing_options
@options.isolation_options(by_default=True)
@options.resume_option
@options.overwrite_option
@options.json_option
@click.pass_context
def score(
    context: click.Context,
    /,
    files: tuple[str, ...],
    minimum: float | None,
    baseline: str | None,
    markdown: Path | None,
    junit: Path | None,
    allow_part: bool,
    overwrite: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """Judge a controller or its results, for CI: see the exit codes below.

    With --controller or --run the controller is tested first, as by `realbench extrinsic`, but
    isolated: submissions are code from strangers. Otherwise FILES are results, folders of results,
    or quoted patterns; results on the same goal set are repeats.

    Checks that all goals were tested, and are those of --goals if given; that trials have full
    length; that the mean is not below --min, nor below the baseline's beyond chance: the 95%
    interval of the difference is not all negative. It is over plays and goals if there are three
    plays of each, else over goals, after these plays. Prints which goals were accepted.
    With --allow-part a finished test of part of the goals (--trials) passes as well.
    """
    from real_bench.scoring import verdict as verdicts
    from real_bench.scoring.named import read_results

    test_options = _given_test_options(context)
    if files and test_options:
        raise click.UsageError(
            f"{test_options[0]} is for running a test: leave it out, or give no FILES"
        )
    if not (files or given["controller"] or given["run"]):
        raise click.UsageError("give result files, or --controller or --run to test")
    verdicts.check_minimum(minimum)
    publish = _publisher(context, markdown, junit, overwrite=overwrite)
    other = None if baseline is None else read_results(baseline)
    if files:
        results = [result for each in files for result in read_results(each)]
    else:
        began = time.monotonic()
        written = [None if baseline is None else Path(baseline), markdown, junit]
        try:
            given |= {"secrets": written, "overwrite": overwrite, "allow_part": allow_part}
            results = [_run_test(quiet=as_json, baseline=other, **given)]
        except ControllerError as error:
            if error.exit_code != ControllerError.exit_code:  # else the job is broken
                name = _named(given["controller"], given["run"])
                publish(*verdicts.failure(name, error, time.monotonic() - began))
            raise
    goals, sizes = _goal_sets(given["goals"], results)
    verdict = verdicts.judge(
        results, minimum, other, goals=goals, sizes=sizes, allow_part=allow_part
    )
    page = verdicts.markdown(verdict)
    publish(page, verdicts.junit(verdict))
    say(json.dumps(verdict.to_json()) if as_json else page.rstrip())
    if not verdict.passed:
        say(f"realbench: not passed: {verdict.failures}", err=True)
        sys.exit(NOT_PASSED)


def _publisher(
    context: click.Context, markdown: Path | None, junit: Path | None, *, overwrite: bool
) -> Callable[[str, JUnitXml], None]:
    """What writes the summary and the cases that were asked for; the files are opened now."""
    cases_file = junit_output(context, junit, overwrite=overwrite)
    page_file = None
    if markdown is not None:
        page_file = context.with_resource(Output(markdown, append=True, option="--markdown"))

    def publish(page: str, cases: JUnitXml) -> None:
        if cases_file is not None:
            cases_file.write(cases.tostring())
        if page_file is not None:
            page_file.write(page.encode())

    return publish


def _given_test_options(context: click.Context) -> list[str]:
    """The test options that were given, as users write them."""
    return [
        parameter.opts[0]
        for parameter in context.command.params
        if parameter.name not in OF_BOTH
        and parameter.expose_value
        and context.get_parameter_source(str(parameter.name)) is ParameterSource.COMMANDLINE
    ]


def _goal_sets(named: Path | None, results: Sequence[Result]) -> tuple[str | None, dict[str, int]]:
    """The hash of the named goals, and the sizes of these and the shipped sets by hash."""
    from real_bench.goal_sets import load_goal_set, shipped_sizes

    setting = results[0].setting
    sizes = shipped_sizes(setting.objects, setting.scene)
    if named is None:
        return None, sizes
    goal_set = load_goal_set(named)
    return goal_set.sha256, {**sizes, goal_set.sha256: len(goal_set)}


def _named(controller: str | None, run: Path | None) -> str:
    """What is tested, as results name it; as it is given where that cannot be found out."""
    from real_bench.controller_code.source import recorded_name
    from real_bench.errors import RealBenchError
    from real_bench.recording import Recording

    try:
        if controller is not None:
            return recorded_name(controller)
        with Recording(run or defaults.RUN) as recording:
            return recording.header.controller
    except RealBenchError:
        return str(controller or run)


def _run_test(*, out: Path, quiet: bool, baseline: Sequence[Result] | None, **given: Any) -> Result:
    from real_bench.scoring.comparison import check_baseline

    def check(plan: TrialPlan) -> None:
        if baseline is not None:
            planned = {
                "scene": plan.scene.name,
                "scene_sha256": plan.scene.sha256,
                "objects": plan.goal_set.n_objects,
                "trial_steps": plan.trial_steps,
            }
            check_baseline(baseline, planned, plan.goal_set.sha256)

    result = running.run_test(out=out, check=check, **given)
    if not quiet:
        running.show_result(result, out, as_json=False)
    return result
