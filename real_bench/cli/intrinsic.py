"""``realbench intrinsic``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from real_bench.cli import options, running
from real_bench.cli.common import progress_wanted
from real_bench.cli.describing import describe_recording, print_facts
from real_bench.cli.printing import say
from real_bench.files import defaults
from real_bench.lengths import INTRINSIC_STEPS

EPILOG = """\b
Example:
  realbench intrinsic --controller real_r --condition OM --steps 100000 --out run.h5
  realbench intrinsic --out run.h5 --resume
"""


@click.command(epilog=EPILOG)
@options.setting_options
@click.option("--steps", type=int, help=f"Length of the phase. [default: {INTRINSIC_STEPS:,}]")
@click.option("--out", type=options.FILE, default=defaults.RUN, show_default=True)
@click.option(
    "--images/--no-images", default=None, help="Record images. [default: in image conditions]"
)
@options.resume_option
@options.overwrite_option
@options.json_option
@options.isolation_options()
def intrinsic(out: Path, resume: bool, overwrite: bool, as_json: bool, **given: Any) -> None:
    """Let a controller play freely and record every action and its outcome.

    A new run defaults to condition IM, one object, scene official, seed 0. A resumed run takes from
    the recording whatever is not given. Ctrl-C stops it after the current action; --resume
    continues a run that was stopped or killed.
    """
    from real_bench.progress.phases import play

    phase = running.plan_from_options(out, resume=resume, **given)
    play(phase, resume=resume, overwrite=overwrite, shown=progress_wanted()).close()
    facts = describe_recording(out)
    if as_json:
        say(json.dumps(facts))
    else:
        print_facts(facts)
