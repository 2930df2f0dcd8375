"""Displacements per 500 actions along the intrinsic phase (paper, fig. real-rmi-intrinsic)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from real_bench.analysis import ACTIONS_PER_PERIOD, moves_by_period
from real_bench.figures import style
from real_bench.figures.drawing import Column, Drawing, Numbers

if TYPE_CHECKING:
    from real_bench.figures.data import FigureData
    from real_bench.figures.played import Play

HEIGHT_CM = 5.6


def draw(data: FigureData) -> Drawing | None:
    """All recordings together; a last period of fewer actions is drawn hollow."""
    plays = [play for play in data.plays if len(play.displacements)]
    if not plays:
        return None
    tables = [({"recording": play.label}, _rows(play)) for play in plays]
    with style.in_style():
        figure, (panel,) = style.panels(1, HEIGHT_CM)
        lines = []
        for number, (play, (_, rows)) in enumerate(zip(plays, tables, strict=True)):
            line_style = style.line_style(number)
            steps = np.asarray(rows["until_step"]) / style.MILLION
            moves = np.asarray(rows["displacements"])
            whole = np.asarray(rows["actions"]) == ACTIONS_PER_PERIOD
            form = line_style.line + line_style.marker
            lines += panel.plot(steps, moves, form, color=line_style.colour, label=play.label)
            panel.plot(
                steps[~whole],
                moves[~whole],
                line_style.marker,
                color=line_style.colour,
                markerfacecolor="w",
            )
        style.show_steps_on_x(panel)
        panel.set_ylabel(f"displacements per {ACTIONS_PER_PERIOD} actions")
        style.show_counts_on_y(panel)
        style.add_legend_below(figure, lines)
    return Drawing(figure, Numbers.stacked(tables))


def _rows(play: Play) -> dict[str, Column]:
    """One row per period."""
    until, sizes = play.periods()
    return {
        "until_step": until,
        "actions": sizes,
        "displacements": moves_by_period(play.displacements),
    }
