"""``realbench score``."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click

from real_bench.cli import options

EPILOG = """\b
Example:
  realbench score score.json --min 0.2
  realbench score 'results/*.json' --baseline best.json --junit junit.xml \\
      --markdown "$GITHUB_STEP_SUMMARY"
"""

NOT_PASSED = 3


@click.command(epilog=EPILOG)
@click.argument("files", nargs=-1, required=True)
@click.option("--min", "minimum", type=float, metavar="X", help="The least mean score.")
@click.option(
    "--baseline",
    metavar="FILE",
    help="Results on the same goals, than which these must not be worse beyond chance.",
)
@click.option("--markdown", type=options.FILE, help="Append a summary to this file.")
@click.option("--junit", type=options.FILE, help="Write the checks as JUnit XML.")
@options.overwrite_option
@options.json_option
def score(
    files: tuple[str, ...],
    minimum: float | None,
    baseline: str | None,
    markdown: Path | None,
    junit: Path | None,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Judge the results of one controller; exits with 3 where a check fails.

    FILES are results, folders of results, or quoted patterns; results on the same goal set are
    repeats. Checks that all trials are made, that the mean is not below --min, and that it is not
    below the baseline's beyond chance: the 95% interval of the difference, goal by goal, is not all
    negative.
    """
    from real_bench.cli.reading import read_results
    from real_bench.files import check_output, write_whole
    from real_bench.scoring import verdict as verdicts

    if junit is not None:
        check_output(junit, overwrite=overwrite)
    results = [result for each in files for result in read_results(each)]
    other = None if baseline is None else read_results(baseline)
    verdict = verdicts.judge(results, minimum, other)
    summary = verdicts.markdown(verdict)
    if markdown is not None:
        before = markdown.read_text(encoding="utf-8") if markdown.exists() else ""
        write_whole(markdown, (before + summary).encode())
    if junit is not None:
        write_whole(junit, verdicts.junit(verdict).tostring())
    click.echo(json.dumps(verdict.to_json()) if as_json else summary.rstrip())
    if not verdict.passed:
        told = "; ".join(f"{each.name}: {each.told}" for each in verdict.checks if not each.passed)
        click.echo(f"realbench: not passed: {told}", err=True)
        sys.exit(NOT_PASSED)
