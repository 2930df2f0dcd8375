"""Displacements per 500 actions along the intrinsic phase (paper, fig. real-rmi-intrinsic)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from real_bench.analysis import ACTIONS_A_PERIOD, moves_by_period
from real_bench.figures import style
from real_bench.figures.drawing import Column, Drawing, Numbers

if TYPE_CHECKING:
    from real_bench.figures.data import FigureData
    from real_bench.figures.played import Play

HEIGHT_CM = 5.6


def draw(material: FigureData) -> Drawing | None:
    """All recordings together; a last period of fewer actions is drawn hollow."""
    plays = [play for play in material.plays if len(play.displacements)]
    if not plays:
        return None
    tables = [({"recording": play.label}, _rows(play)) for play in plays]
    with style.in_style():
        figure, (panel,) = style.panels(1, HEIGHT_CM)
        lines = []
        for number, (play, (_, rows)) in enumerate(zip(plays, tables, strict=True)):
            sign = style.sign(number)
            steps = np.asarray(rows["until_step"]) / style.MILLION
            moves = np.asarray(rows["displacements"])
            whole = np.asarray(rows["actions"]) == ACTIONS_A_PERIOD
            form = sign.line + sign.marker
            lines += panel.plot(steps, moves, form, color=sign.colour, label=play.label)
            panel.plot(
                steps[~whole], moves[~whole], sign.marker, color=sign.colour, markerfacecolor="w"
            )
        panel.set_xlabel("step of the intrinsic phase (millions)")
        panel.set_ylabel(f"displacements per {ACTIONS_A_PERIOD} actions")
        panel.set_xlim(left=0)
        style.count_upward(panel)
        style.legend_below(figure, lines)
    return Drawing(figure, Numbers.stacked(tables))


def _rows(play: Play) -> dict[str, Column]:
    """One row per period."""
    until, sizes = play.periods()
    return {
        "until_step": until,
        "actions": sizes,
        "displacements": moves_by_period(play.displacements),
    }
