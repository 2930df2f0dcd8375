"""A moment of a play, shown in a terminal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from rich.console import Group
from rich.table import Table
from rich.text import Text

from real_bench.text.counting import counted
from real_bench.text.naming import display_name
from real_bench.text.quoting import printable
from real_bench.watching.curves import ASCII, BLOCKS, bin_means, curve
from real_bench.watching.following import Moment
from real_bench.watching.status import LATEST_ACTIONS

CURVE_LINES = 4
MAX_CURVES = 6
LABEL_WIDTH = 24
ACTIONS_PER_COLUMN = 10
"""The fewest actions per column of the share that moved an object."""


def line_of(moment: Moment) -> str:
    """A moment in one line, for a log."""
    status = moment.status
    share = 100 * status.n_steps / max(status.total_steps, 1)
    steps = f"{status.n_steps:,} of {status.total_steps:,} steps ({share:.0f}%)"
    return ", ".join([f"{status.what}: {steps}", *_pace(moment), _moves(moment)])


def screen_of(moment: Moment, width: int, *, ascii_only: bool = False) -> Group:
    """A moment with curves, as wide as the terminal.

    Args:
        moment: what to show.
        width: in characters.
        ascii_only: whether the terminal has no block characters.
    """
    status, header = moment.status, moment.status.header
    title = (
        f"{status.path.name}: {display_name(header.controller)}, {header.condition}, "
        f"{counted(header.objects, 'object')}, scene {header.scene}, seed {header.seed}"
    )
    curves = Table(box=None, show_header=False, pad_edge=False, padding=(0, 1))
    room = max(width - LABEL_WIDTH - 2, 20)
    moved = status.moved.astype(np.float64)
    drawn = {"moved an object": (status.ended_at, moved), **status.numbers()}
    for name, (steps, values) in list(drawn.items())[:MAX_CURVES]:
        if len(values):
            most = -(-len(values) // ACTIONS_PER_COLUMN) if values is moved else len(values)
            bins = bin_means(steps, values, status.n_steps, min(room, most))
            low, high = (0.0, 1.0) if values is moved else _range(bins)
            lines = curve(bins, CURVE_LINES, low, high, ASCII if ascii_only else BLOCKS)
            curves.add_row(_label(name, values, low, high), Text("\n".join(lines)))
    more = len(drawn) - MAX_CURVES
    rest = (
        [Text(f"and {counted(more, 'more number')} (--tensorboard shows all)")] if more > 0 else []
    )
    return Group(Text(printable(title)), Text(line_of(moment)), curves, *rest)


def _pace(moment: Moment) -> list[str]:
    texts = [] if moment.speed is None else [f"{moment.speed:,.0f} steps/s"]
    if (left := moment.seconds_left) is not None:
        minutes, seconds = divmod(round(left), 60)
        texts.append(f"{minutes // 60}:{minutes % 60:02d}:{seconds:02d} left")
    return texts


def _moves(moment: Moment) -> str:
    status = moment.status
    if status.share_moved is None or status.share_moved_recently is None:
        return "no action yet"
    texts = f"{status.share_moved:.0%} of {status.n_actions:,} actions moved an object"
    recently = f", {status.share_moved_recently:.0%} of the last {LATEST_ACTIONS}"
    return texts + (recently if status.n_actions > LATEST_ACTIONS else "")


def _range(values: NDArray[np.float64]) -> tuple[float, float]:
    good = values[np.isfinite(values)]
    return (float(good.min()), float(good.max())) if len(good) else (0.0, 1.0)


def _label(name: str, values: NDArray[np.float64], low: float, high: float) -> Text:
    name = printable(name)
    shown = name if len(name) <= LABEL_WIDTH else name[: LABEL_WIDTH - 3] + "..."
    lines = [shown, f"top     {high:.4g}", f"bottom  {low:.4g}", f"last    {values[-1]:.4g}"]
    return Text("\n".join(line.ljust(LABEL_WIDTH) for line in lines))
