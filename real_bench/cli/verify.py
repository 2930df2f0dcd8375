"""``realbench verify``."""

from __future__ import annotations

import json
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from real_bench.cli import options
from real_bench.cli.common import progress_display
from real_bench.cli.printing import say
from real_bench.files.kinds import ARCHIVE, RECORDING, first_bytes

if TYPE_CHECKING:
    from real_bench.progress.display import ProgressDisplay
    from real_bench.verification import RecordingVerdict, ResultVerdict

EPILOG = """\b
Example:
  realbench verify score.json --jobs 2
  realbench verify score.json --goals goals.npy --run run.h5 --controller mine.py
  realbench verify run.h5 --steps 200000
  realbench verify mailed/ --goals goals.npy --relearn 5

\b
Exit code: 0 verified; 4 does not verify; 5 made with different physics, cannot be judged here;
1 cannot be read or replayed at all. For a folder: 0 all verify; 4 one does not; 5 one cannot be
judged here.
"""

DOES_NOT_VERIFY, OTHER_PHYSICS = 4, 5

KINDS: dict[str, tuple[str, ...]] = {
    "result": ("goals", "run", "controller", "may_be_incomplete", "jobs"),
    "recording": ("n_steps", "images"),
    "folder": ("goals", "may_be_incomplete", "jobs", "n_steps", "n_again", "play_again"),
}
"""What can be verified, and the options for each."""
OPTIONS = {
    "n_steps": "--steps",
    "may_be_incomplete": "--allow-incomplete",
    "n_again": "--relearn",
    "play_again": "--play-again",
}


@click.command(epilog=EPILOG)
@click.argument("file", type=options.FILE)
@click.option(
    "--goals",
    type=options.FILE,
    help="Goal set of the results. [default: that of their round, or the shipped one]",
)
@click.option(
    "--run", type=options.FILE, help="Also check the recording that a result learned from."
)
@click.option(
    "--controller",
    metavar="C",
    help="Also check that a result is of this controller, a file or name.",
)
@click.option(
    "--allow-incomplete",
    "may_be_incomplete",
    is_flag=True,
    default=None,
    help="Accept a result whose trials have not all been run.",
)
@click.option("--jobs", type=int, help="Number of processes for a result. [default: 1]")
@click.option(
    "--steps",
    "n_steps",
    type=int,
    metavar="N",
    help="Replay N steps of a recording. [default: all]",
)
@click.option("--images", is_flag=True, default=None, help="Also compare a recording's images.")
@click.option(
    "--relearn",
    "n_again",
    type=click.IntRange(min=0),
    metavar="N",
    help="In a folder, let each submission learn and act again, isolated, on N goals drawn at "
    "random; 0: run none. [default: 2]",
)
@click.option(
    "--play-again",
    is_flag=True,
    default=None,
    help="In a folder, let each submission play again (takes as long as the play; if it differs, "
    "twice as long).",
)
@options.scene_option
@options.limit_options
@options.json_option
def verify(
    file: Path, scene: str | None, limits: dict[str, float], as_json: bool, **given: Any
) -> None:
    """Prove a result (.json) or a recording (.h5) by replaying it, or all bundles in a folder.

    The recorded commands are executed in a clean simulation; poses and scores must come out as
    recorded: to the last bit, or to a millimetre if made with different physics
    (`realbench doctor`). docs/verification.md says what this proves and what it does not.

    A bundle is what somebody sends in: a result, the recording that it learned from, and the
    submission. It is checked as a whole: the same code and settings played and were tested, play
    and trials replay, and the submission learns and acts the same again. Of a round, what its
    leaderboard shows is verified, within the round's limits, and the verdicts are kept for it.
    """
    kind = _kind(file)
    for name, value in given.items():
        if value is not None and name not in KINDS[kind]:
            raise click.UsageError(f"{OPTIONS.get(name, '--' + name)} is not for a {kind}: {file}")
    wanted = {name: value for name, value in given.items() if value is not None}
    if kind == "folder":
        return _verify_folder(file, as_json, limits, scene=scene, **wanted)
    if limits:
        raise click.UsageError("limits are for submissions in a folder: nothing else is run")
    verdict = _verdict(file, kind == "recording", scene=scene, **wanted)
    say(json.dumps(verdict.to_json()) if as_json else "\n".join(verdict.lines()))
    if verdict.is_undecided:
        sys.exit(OTHER_PHYSICS)
    if not verdict.holds:
        sys.exit(DOES_NOT_VERIFY)


def _verify_folder(folder: Path, as_json: bool, limits: dict[str, float], **wanted: Any) -> None:
    from real_bench.cli.verifying import verify_folder

    if wanted.get("n_again", 1) or wanted.get("play_again"):
        options.print_isolation()
    verdicts = verify_folder(folder, as_json=as_json, limits=limits, **wanted)
    if any(not verdict.holds and not verdict.is_undecided for verdict in verdicts):
        sys.exit(DOES_NOT_VERIFY)
    if not all(verdict.holds for verdict in verdicts):
        sys.exit(OTHER_PHYSICS)


def _kind(file: Path) -> str:
    """What a file is, by its first bytes or else by its suffix; or a folder."""
    if file.is_dir():
        return "folder"
    if not file.is_file():
        return "recording" if file.suffix in (".h5", ".hdf5") else "result"
    first = first_bytes(file)
    if ARCHIVE.begins(first):
        raise click.UsageError(f"{file} is an archive: unpack it, and give the folder")
    is_recording = RECORDING.begins(first)
    return "recording" if is_recording else "result"


def _verdict(file: Path, is_recording: bool, **wanted: Any) -> RecordingVerdict | ResultVerdict:
    """Verify with progress shown."""
    from real_bench.verification import RecordingVerification, ResultVerification

    unit = "steps" if is_recording else "trials"
    with ExitStack() as stack:
        displays: list[ProgressDisplay] = []

        def report(done: int, total: int) -> None:
            if not displays:
                display = progress_display(f"replaying {file.name}", unit, total)
                displays.append(stack.enter_context(display))
            displays[0].update(done)

        if is_recording:
            return RecordingVerification(file, **wanted).verify(report)
        return ResultVerification(file, **wanted).verify(report)
