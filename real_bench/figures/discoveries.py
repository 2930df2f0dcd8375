"""What play discovers and when: objects moved, moved far, raised."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from real_bench.analysis import ACTIONS_PER_PERIOD, NEAR_M, count_by_period
from real_bench.figures import style
from real_bench.figures.drawing import Column, Drawing, Numbers
from real_bench.recording import MOVED_M

if TYPE_CHECKING:
    from real_bench.figures.data import FigureData
    from real_bench.figures.played import Play

HEIGHT_CM = 5.6
RAISED_M = 0.05
"""Half the way from the table up to the shelf."""

PANELS = {
    "moved": f"moved by {100 * MOVED_M:.0f} cm",
    "far": f"moved by {100 * NEAR_M[1]:.0f} cm",
    "raised": f"left {100 * RAISED_M:.0f} cm higher",
}


def draw(data: FigureData) -> Drawing | None:
    """A panel per discovery, all recordings together.

    Periods of fewer actions only as numbers; hollow for a recording that has no other.
    """
    plays = [play for play in data.plays if len(play.displacements)]
    if not plays:
        return None
    tables = [({"recording": play.label}, _rows(play)) for play in plays]
    with style.in_style():
        figure, panels = style.panels(len(PANELS), HEIGHT_CM)
        lines = []
        for number, (play, (_, rows)) in enumerate(zip(plays, tables, strict=True)):
            line_style = style.line_style(number)
            whole = np.asarray(rows["actions"]) == ACTIONS_PER_PERIOD
            fill = line_style.colour if whole.any() else "none"
            whole |= not whole.any()
            steps = np.asarray(rows["until_step"])[whole] / style.MILLION
            form = line_style.line + (line_style.marker if len(steps) < 2 else "")
            for name, panel in zip(PANELS, panels, strict=True):
                shares = np.asarray(rows[name])[whole]
                drawn = panel.plot(
                    steps,
                    shares,
                    form,
                    color=line_style.colour,
                    markerfacecolor=fill,
                    label=play.label,
                )
            lines += drawn
        for title, panel in zip(PANELS.values(), panels, strict=True):
            panel.set_title(title)
            style.show_steps_on_x(panel)
            panel.set_ylim(bottom=0)
        panels[0].set_ylabel("share of the actions")
        style.add_legend_below(figure, lines)
    return Drawing(figure, Numbers.stacked(tables))


def _rows(play: Play) -> dict[str, Column]:
    """One row per period of actions; the last one may be shorter."""
    until, sizes = play.periods()
    happened = {
        "moved": play.displacements > MOVED_M,
        "far": play.displacements > NEAR_M[1],
        "raised": play.raised > RAISED_M,
    }
    shares = {name: count_by_period(each) / sizes for name, each in happened.items()}
    return {"until_step": until, "actions": sizes, **shares}
