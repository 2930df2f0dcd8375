"""``realbench verify``."""

from __future__ import annotations

import json
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from real_bench.cli import options
from real_bench.cli.printing import say

if TYPE_CHECKING:
    from real_bench.verification import RecordingVerdict, ResultVerdict

EPILOG = """\b
Example:
  realbench verify score.json --jobs 2
  realbench verify score.json --goals goals.npy --run run.h5 --controller mine.py
  realbench verify run.h5 --steps 200000

\b
Exit code: 0 verified; 4 does not verify; 5 made with other physics, cannot be judged here;
1 cannot be read or replayed at all.
"""

DOES_NOT_VERIFY, OTHER_PHYSICS = 4, 5
HDF5 = b"\x89HDF"

OF_RESULTS = ("goals", "run", "controller", "may_be_incomplete", "jobs")
OF_RECORDINGS = ("n_steps", "images")
OPTIONS = {"n_steps": "--steps", "may_be_incomplete": "--allow-incomplete"}


@click.command(epilog=EPILOG)
@click.argument("file", type=options.FILE)
@click.option("--goals", type=options.FILE, help="Goal set of a result. [default: the shipped one]")
@click.option("--run", type=options.FILE, help="Recording that a result learned from, to check it.")
@click.option("--controller", metavar="C", help="File or name of what was tested, to check it.")
@click.option(
    "--allow-incomplete",
    "may_be_incomplete",
    is_flag=True,
    default=None,
    help="Accept a result whose trials have not all been made.",
)
@click.option("--jobs", type=int, help="Number of processes for a result. [default: 1]")
@click.option(
    "--steps",
    "n_steps",
    type=int,
    metavar="N",
    help="Replay N steps of a recording. [default: all]",
)
@click.option("--images", is_flag=True, default=None, help="Compare a recording's images, too.")
@options.scene_option
@options.json_option
def verify(file: Path, scene: str | None, as_json: bool, **given: Any) -> None:
    """Prove a result (.json) or a recording (.h5) by replaying it.

    The recorded commands are executed in a clean simulation; poses and scores must come out as
    recorded, to the last bit; with other physics than that of this machine (`realbench doctor`), to
    a millimetre. What this proves and what it does not is in docs/verification.md.
    """
    is_recording = _is_recording(file)
    mine, others = (OF_RECORDINGS, OF_RESULTS) if is_recording else (OF_RESULTS, OF_RECORDINGS)
    for name in others:
        if given[name] is not None:
            kind = "recording" if is_recording else "result"
            raise click.UsageError(f"{OPTIONS.get(name, '--' + name)} is not for a {kind}: {file}")
    wanted = {name: given[name] for name in mine if given[name] is not None}
    verdict = _verdict(file, is_recording, scene=scene, **wanted)
    say(json.dumps(verdict.to_json()) if as_json else "\n".join(verdict.lines()))
    if verdict.is_undecided:
        sys.exit(OTHER_PHYSICS)
    if not verdict.holds:
        sys.exit(DOES_NOT_VERIFY)


def _is_recording(file: Path) -> bool:
    """By its first bytes; by its name where there are none."""
    if not file.is_file():
        return file.suffix in (".h5", ".hdf5")
    with file.open("rb") as opened:
        return opened.read(len(HDF5)) == HDF5


def _verdict(file: Path, is_recording: bool, **wanted: Any) -> RecordingVerdict | ResultVerdict:
    """Verify with progress shown."""
    from real_bench.cli.progress import ProgressDisplay
    from real_bench.verification import RecordingVerification, ResultVerification

    unit = "steps" if is_recording else "trials"
    with ExitStack() as stack:
        displays: list[ProgressDisplay] = []

        def report(done: int, total: int) -> None:
            if not displays:
                display = ProgressDisplay(f"replaying {file.name}", unit, total)
                displays.append(stack.enter_context(display))
            displays[0].update(done)

        if is_recording:
            return RecordingVerification(file, **wanted).verify(report)
        return ResultVerification(file, **wanted).verify(report)
