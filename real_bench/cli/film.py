"""``realbench film``."""

from __future__ import annotations

from pathlib import Path

import click

from real_bench.cli import options
from real_bench.cli.common import progress_display
from real_bench.cli.printing import say
from real_bench.text.counting import counted

EPILOG = """\b
Example:
  realbench film run.h5 --actions 10:20 --out play.mp4
  realbench film run.h5 --actions -5:            the last five
  realbench film run.h5 --actions 7 --gui        action 7, in a window
"""

DEFAULT_FILM = Path("play.mp4")


def _range(context: click.Context, option: click.Parameter, value: str) -> slice:
    """``10:20``, ``10:``, ``:20``, ``-5:`` or a single number, as Python counts."""
    first, colon, last = value.partition(":")
    try:
        begin, end = (int(part) if part.strip() else None for part in (first, last))
    except ValueError:
        begin = end = None
    if begin is None and end is None and value != ":":
        raise click.BadParameter(f"{value!r} is not a range of actions like 10:20, 10:, -5: or 7")
    if colon:
        return slice(begin, end)
    assert begin is not None  # refused above
    return slice(begin, begin + 1 or None)


@click.command(epilog=EPILOG)
@click.argument("file", type=options.FILE)
@click.option(
    "--actions",
    callback=_range,
    metavar="A:B",
    default="-10:",
    show_default=True,
    help="From action A up to, not including, action B, counted from 0.",
)
@click.option("--out", type=options.FILE, help=f"The film, MP4. [default: {DEFAULT_FILM}]")
@click.option(
    "--gui", is_flag=True, help="Show it in pybullet's window instead; it needs a display."
)
@options.scene_option
@options.overwrite_option
def film(
    file: Path, actions: slice, out: Path | None, gui: bool, scene: str | None, overwrite: bool
) -> None:
    """Make a film of a part of a recording, as it was played.

    The actions are replayed exactly, so everything since the run began or was last resumed must be
    replayed: a late part of a long run takes minutes. Each frame shows condition, action and step;
    a second of film is 4 seconds of robot time.
    """
    from real_bench.files.outputs import check_output
    from real_bench.phases.film import check_films
    from real_bench.recording import Recording
    from real_bench.replay import PartReplay
    from real_bench.replay.showing import film_part, show_part

    if gui and out is not None:
        raise click.UsageError("--gui shows a window and writes no film: leave out --out")
    out = out or DEFAULT_FILM
    if out.suffix.lower() != DEFAULT_FILM.suffix:
        raise click.UsageError(f"{out} must end in {DEFAULT_FILM.suffix}: a film is MP4")
    with Recording(file) as recording:
        n_actions = len(recording)
    first, last, _ = actions.indices(n_actions)
    if first >= last:
        raise click.UsageError(
            f"{file} has {counted(n_actions, 'action')}"
            + (f", 0 to {n_actions - 1}: --actions selects none" if n_actions else ": no film")
        )
    if not gui:
        check_output(out, overwrite=overwrite)
        check_films()
    replay = PartReplay(file, first, last, scene)
    with progress_display(f"replaying {file.name}", "actions", last) as display:

        def report(done: int, total: int) -> None:
            display.update(last - total + done)

        good = show_part(replay, report) if gui else film_part(replay, out, report)
    if not gui:
        remark = "" if good else "; it differs from the recording"
        say(f"film of actions {first} to {last - 1}: {out}{remark}")
