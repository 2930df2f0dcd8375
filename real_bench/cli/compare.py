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
    and the probability that A is better than B on a goal. The 95% interval of the difference is
    over plays and goals if there are three plays of each, else over goals alone, after these plays.
    """
    from real_bench.physics import physics_of
    from real_bench.scoring.comparison import compare as compare_results
    from real_bench.scoring.named import read_results
    from real_bench.scoring.sides import remarks, side_json
    from real_bench.scoring.table import comparison_table

    ours, theirs = (read_results(each) for each in (a, b))
    comparison = compare_results(ours, theirs)
    if not as_json:
        print_tables(comparison_table(comparison, ours, theirs))
        return
    physics = {physics_of(result.setting.versions) for result in (*ours, *theirs)}
    facts = {
        "a": side_json(ours),
        "b": side_json(theirs),
        "physics": sorted(physics),
        "remarks": remarks(comparison, ours, theirs),
    }
    say(json.dumps({**comparison.to_json(), **facts}))
