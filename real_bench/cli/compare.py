"""``realbench compare``."""

from __future__ import annotations

import json

import click

from real_bench.cli import options
from real_bench.cli.printing import print_tables, say

EPILOG = """\b
Example:
  realbench compare mine.json theirs.json
  realbench compare 'results/real_d-OM-1-*.json' 'results/real_t-OM-1-*.json'
"""


@click.command(epilog=EPILOG)
@click.argument("a")
@click.argument("b")
@options.json_option
def compare(a: str, b: str, as_json: bool) -> None:
    """Compare two sets of scores, A and B, on the same goals.

    A and B are each a result, a folder of results, or a quoted pattern. Results on the same goal
    set are repeats. Prints the score of both on each goal; and for every metric the mean difference
    and the probability that A is better than B on a goal, both with a 95% interval over goals: what
    to expect on other goals, not after other plays.
    """
    from real_bench.physics import mixture, physics_of
    from real_bench.scoring.comparison import compare as compare_results
    from real_bench.scoring.named import read_results
    from real_bench.scoring.one_test import mixed_sources, sources_of
    from real_bench.scoring.table import comparison_table

    ours, theirs = (read_results(each) for each in (a, b))
    comparison = compare_results(ours, theirs)
    physics = [physics_of(result.setting.versions) for result in (*ours, *theirs)]
    if as_json:
        say(json.dumps({**comparison.to_json(), "physics": sorted(set(physics))}))
    else:
        mixed = [mixed_sources(sources_of(results)) for results in (ours, theirs)]
        remarks = [f"{name}: {remark}" for name, remark in zip("AB", mixed, strict=True) if remark]
        remarks += filter(None, [mixture(physics)])
        print_tables(comparison_table(comparison, ours, theirs), *remarks)
