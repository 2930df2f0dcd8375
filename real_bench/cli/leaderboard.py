"""``realbench leaderboard``."""

from __future__ import annotations

import json
from pathlib import Path

import click

from real_bench.cli import options
from real_bench.cli.printing import print_tables, say

JSON = "json"
FORMATS = ("text", "markdown", JSON)

EPILOG = """\b
Example:
  realbench leaderboard results/
  realbench leaderboard results/ --format markdown --round final
  realbench leaderboard results/ --site site
"""


@click.command(epilog=EPILOG)
@click.argument("results", type=options.FILE)
@options.round_option
@click.option("--format", "form", type=click.Choice(FORMATS), default="text", show_default=True)
@click.option(
    "--site", type=options.FILE, metavar="DIR", help="Write a static site, one page per submission."
)
@click.option(
    "--films", is_flag=True, help="Film every trial for the site (takes as long as a test)."
)
@options.overwrite_option
@options.json_option
def leaderboard(
    results: Path,
    name: str | None,
    form: str,
    site: Path | None,
    films: bool,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Rank the submissions of the rounds in RESULTS.

    Prints rank, mean, 95% interval, the score on each class of goals, status, date, hash, and
    whether the results were verified (`realbench verify RESULTS`). The site shows pictures of
    secret goals only once the round says that they are released.
    """
    from real_bench.competition import leaderboard as boards

    found = boards.read_leaderboards(results, name)
    if site is not None:
        from real_bench.competition.site import write_site

        for remark in write_site(found, site, films=films, overwrite=overwrite):
            say(f"realbench: {remark}", err=True)
        say(f"site: {site / 'index.html'}")
        return
    if films:
        raise click.UsageError("--films needs --site")
    if as_json and form == "markdown":
        raise click.UsageError("--json is a format of its own: leave out --format")
    if as_json or form == JSON:
        say(json.dumps(boards.json_boards(found)))
    elif form == "markdown":
        say("\n\n".join(map(boards.markdown_table, found)))
    else:
        print_tables(*map(boards.text_table, found))
