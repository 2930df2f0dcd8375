"""``realbench inspect``."""

from __future__ import annotations

import json
from pathlib import Path

import click

from real_bench.cli import kinds, options
from real_bench.cli.describing import (
    describe_experiment,
    describe_goals,
    describe_recording,
    describe_result,
    print_facts,
)
from real_bench.cli.printing import say

EPILOG = """\b
Example:
  realbench inspect run.h5
  realbench inspect score.json --json
"""


@click.command(epilog=EPILOG)
@click.argument("file", type=options.FILE)
@options.json_option
def inspect(file: Path, as_json: bool) -> None:
    """Show what is in a recording (.h5), goal set (.npy), result (.json) or experiment (.yaml)."""
    describe = {
        kinds.RECORDING: describe_recording,
        kinds.GOAL_SET: describe_goals,
        kinds.RESULT: describe_result,
        kinds.EXPERIMENT: describe_experiment,
    }
    facts = describe[kinds.kind_of(file)](file)
    if as_json:
        say(json.dumps(facts))
    else:
        print_facts(facts)
