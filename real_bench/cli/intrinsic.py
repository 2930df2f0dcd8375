"""``realbench intrinsic``."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from real_bench.cli import options
from real_bench.cli.printing import say
from real_bench.lengths import INTRINSIC_STEPS

if TYPE_CHECKING:
    from real_bench.phases.guest import Guest, Host
    from real_bench.phases.intrinsic import IntrinsicPhase

EPILOG = """\b
Example:
  realbench intrinsic --controller real_r --condition OM --steps 100000 --out run.h5
  realbench intrinsic --out run.h5 --resume
"""


@click.command(epilog=EPILOG)
@options.setting_options
@click.option("--steps", type=int, help=f"Length of the phase. [default: {INTRINSIC_STEPS:,}]")
@click.option("--out", type=options.FILE, default=options.DEFAULT_RUN, show_default=True)
@click.option(
    "--images/--no-images", default=None, help="Record images. [default: in image conditions]"
)
@options.resume_option
@options.overwrite_option
@options.json_option
@options.isolation_options()
def intrinsic(out: Path, resume: bool, overwrite: bool, as_json: bool, **given: Any) -> None:
    """Let a controller play freely and record every action and its outcome.

    Defaults of a new run: condition IM, one object, scene official, seed 0. A resumed run takes
    all it is not told from the recording. Ctrl-C stops it after the current action; a run that
    was stopped or killed goes on with --resume.
    """
    phase = plan_phase(out, resume=resume, **given)
    play(phase, resume=resume, overwrite=overwrite).close()
    show(out, as_json=as_json)


NEW_RUN: dict[str, Any] = {
    "controller": None,
    "condition": "IM",
    "objects": 1,
    "scene": "official",
    "steps": INTRINSIC_STEPS,
    "seed": 0,
    "images": None,
    "settings": {},
}


def plan_phase(
    out: Path,
    *,
    settings_file: Path | None,
    assignments: tuple[str, ...],
    isolation: options.Isolation = options.NOT_ISOLATED,
    secrets: Iterable[Path | None] = (),
    resume: bool = False,
    **given: Any,
) -> IntrinsicPhase:
    """The phase that the given options describe; what they leave out is the recording's.

    An isolated controller must not be able to read the recording, nor ``secrets``.
    """
    from real_bench.conditions import Condition
    from real_bench.phases.intrinsic import IntrinsicPhase
    from real_bench.settings import merged, read_settings
    from real_bench.simulation import load_scene

    host = isolation.host([out, *secrets])
    defaults = _recorded(out, given["controller"], host) if resume and out.exists() else NEW_RUN
    chosen = {**defaults, **{key: value for key, value in given.items() if value is not None}}
    chosen["settings"] = merged(defaults["settings"], read_settings(settings_file, assignments))
    if chosen["controller"] is None:
        raise click.UsageError("--controller is missing (try --controller real_r)")
    chosen["condition"] = Condition.parse(chosen["condition"])
    chosen["scene"] = load_scene(chosen["scene"])
    return IntrinsicPhase(out=out, host=host, **chosen)


def _recorded(path: Path, controller: str | None, host: Host) -> dict[str, Any]:
    """The options that a recording was made with; settings only for its own controller."""
    from real_bench.recording import Recording

    with Recording(path) as recording:
        header = recording.header
        return {
            "controller": header.controller_source,
            "condition": header.condition,
            "objects": header.objects,
            "scene": header.scene_source,
            "steps": recording.total_steps,
            "seed": header.seed,
            "images": header.images,
            "settings": options.recorded_settings(header, controller, host),
        }


def play(phase: IntrinsicPhase, *, resume: bool, overwrite: bool) -> Guest:
    """Run the phase with progress shown."""
    from real_bench.cli.progress import ProgressDisplay
    from real_bench.phases.intrinsic import Progress

    with ProgressDisplay(f"playing {phase.controller}", "steps", phase.steps) as display:

        def report(progress: Progress) -> None:
            moved = progress.n_moved / progress.n_actions
            rate = display.rate(progress.n_steps)
            display.update(
                progress.n_steps, f"{rate:,.0f} steps/s, {moved:.0%} of actions moved an object"
            )

        with contextlib.redirect_stdout(sys.stderr):  # what a controller prints is no result
            return phase.run(report, resume=resume, overwrite=overwrite)


def show(out: Path, *, as_json: bool) -> None:
    """Say what was recorded."""
    from real_bench.cli.inspect import describe_recording, print_facts

    facts = describe_recording(out)
    if as_json:
        say(json.dumps(facts))
    else:
        print_facts(facts)
