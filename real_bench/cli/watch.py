"""``realbench watch``."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from real_bench.cli import options
from real_bench.cli.printing import say
from real_bench.files import defaults

if TYPE_CHECKING:
    from real_bench.watching import Moment

EPILOG = """\b
Example:
  realbench intrinsic --controller real_r --out run.h5 &
  realbench watch run.h5
  realbench watch run.h5 --tensorboard events    then: tensorboard --logdir events
"""

WAIT_S = 10
"""A play writes its recording a few seconds after its start."""


@click.command(epilog=EPILOG)
@click.argument("file", type=options.FILE, default=defaults.RUN)
@click.option("--once", is_flag=True, help="Print the progress once, and exit.")
@click.option(
    "--every",
    type=click.FloatRange(0.05, 3600),
    default=1.0,
    show_default=True,
    metavar="S",
    help="Update every S seconds.",
)
@click.option(
    "--tensorboard",
    "events",
    type=options.FILE,
    metavar="DIR",
    help="Also write TensorBoard event files to DIR.",
)
@click.option("--overwrite", is_flag=True, help="Replace the event files in DIR.")
@options.json_option
def watch(
    file: Path, once: bool, every: float, events: Path | None, overwrite: bool, as_json: bool
) -> None:
    """Follow a play by its recording FILE, run.h5 by default, until it ends or you press Ctrl-C.

    Shows steps, speed, time left, the share of actions that moved an object by more than 1 cm, and
    what the controller logs (self.log), all as curves; outside a terminal, a line at each change.
    Watching does not affect the play.
    """
    from real_bench.watching import follow, read_status

    if overwrite and events is None:
        raise click.UsageError("--overwrite needs --tensorboard")
    if not once:
        _wait_for(file)
    with ExitStack() as stack, suppress(KeyboardInterrupt):
        outputs: list[Callable[[Moment], None]] = [_json if as_json else _open_display(stack)]
        if events is not None:
            from real_bench.watching.tensorboard import EventFiles

            read_status(file)  # an error leaves earlier event files as they are
            outputs.append(stack.enter_context(EventFiles(events, overwrite=overwrite)).add)
        _show_all(follow(file, every), outputs, once=once)


def _wait_for(file: Path) -> None:
    """Wait for a play that has only just been started; return in any case."""
    until = time.monotonic() + WAIT_S
    if not file.exists():
        say(f"waiting for {file}", err=True)
    while not file.exists() and time.monotonic() < until:
        time.sleep(0.2)


def _show_all(
    moments: Iterable[Moment], outputs: Iterable[Callable[[Moment], None]], *, once: bool
) -> None:
    for moment in moments:
        for output in outputs:
            output(moment)
        if once:
            return


def _json(moment: Moment) -> None:
    facts = {**moment.status.to_json(), "steps_a_second": moment.speed}
    say(json.dumps({**facts, "seconds_left": moment.seconds_left}))


def _open_display(stack: ExitStack) -> Callable[[Moment], None]:
    """A function that shows moments: on a live screen in a terminal, or else as lines."""
    from rich.console import Console
    from rich.live import Live

    from real_bench.watching.screen import line_of, screen_of

    console = Console(markup=False, emoji=False, highlight=False)
    if not console.is_terminal:
        return lambda moment: say(line_of(moment))
    live = stack.enter_context(Live(console=console, auto_refresh=False))
    ascii_only = console.options.ascii_only

    def output(moment: Moment) -> None:
        live.update(screen_of(moment, console.width, ascii_only=ascii_only), refresh=True)

    return output
