"""``realbench extrinsic``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from real_bench.cli import options, running

EPILOG = """\b
Example:
  realbench extrinsic --run run.h5 --goals goals.npy --out score.json --jobs 2
  realbench extrinsic --controller real_d --set planner.depth=8 --explain why
  realbench extrinsic --controller real_r --condition OM --trials 5
"""


@click.command(epilog=EPILOG)
@options.setting_options
@options.testing_options
@click.option(
    "--video", type=options.FILE, metavar="DIR", help="Write a film of each trial (.mp4) to DIR."
)
@click.option(
    "--pictures",
    type=options.FILE,
    metavar="DIR",
    help="Write start, goal and end of each trial (.png) to DIR.",
)
@click.option(
    "--explain",
    type=options.FILE,
    metavar="DIR",
    help="Write why each action was chosen to DIR: a .json and a .png per trial.",
)
@options.resume_option
@options.overwrite_option
@options.json_option
@options.isolation_options()
def extrinsic(out: Path, as_json: bool, **given: Any) -> None:
    """Test a controller on goals that it has never seen, and print the score table.

    Controller, settings, condition, objects and scene default to those of the recording. Every
    trial lasts 10,000 steps and begins in a fresh world. To judge a result in CI, see
    `realbench score`.
    """
    result = running.run_test(out=out, allow_part=True, **given)
    running.show_result(result, out, as_json=as_json)
