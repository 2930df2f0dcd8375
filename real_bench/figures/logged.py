"""Numbers that controllers logged along the intrinsic phase (``Controller.log``)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from real_bench.figures import style
from real_bench.figures.drawing import Column, Drawing, Numbers
from real_bench.text.quoting import printable

if TYPE_CHECKING:
    from real_bench.figures.data import FigureData
    from real_bench.figures.played import Play

HEIGHT_CM = 5.6
MAX_PANELS = 12
LARGEST_DRAWN = 1e300
"""An axis cannot be divided far beyond."""


def draw(data: FigureData) -> Drawing | None:
    """A panel per name, all recordings together; at most the first twelve names.

    Infinite and enormous numbers are gaps in the lines.
    """
    plays = [play for play in data.plays if len(play.logged)]
    if not plays:
        return None
    names = list(dict.fromkeys(name for play in plays for name in play.logged["name"]))
    with style.in_style():
        figure, panels = style.panels(min(len(names), MAX_PANELS), HEIGHT_CM)
        lines = []
        for number, play in enumerate(plays):
            line_style = style.line_style(number)
            handle = None
            for name, panel in zip(names, panels, strict=False):
                rows = play.logged[play.logged["name"] == name]
                steps = rows["step"] / style.MILLION
                mark = line_style.marker if len(rows) < 2 else ""
                (handle,) = panel.plot(
                    steps,
                    np.where(np.abs(rows["value"]) <= LARGEST_DRAWN, rows["value"], np.nan),
                    line_style.line + mark,
                    color=line_style.colour,
                    label=play.label,
                )
            lines += [handle] if handle else []
        for name, panel in zip(names, panels, strict=False):
            panel.set_title(style.title(printable(name)))
            style.show_steps_on_x(panel)
        if len(names) > MAX_PANELS:
            figure.suptitle(f"{MAX_PANELS} of {len(names)} names; all are in the numbers (CSV)")
        style.add_legend_below(figure, lines)
    tables = [({"recording": play.label}, _rows(play)) for play in plays]
    return Drawing(figure, Numbers.stacked(tables))


def _rows(play: Play) -> dict[str, Column]:
    """One row per logged number, of every name."""
    rows = play.logged
    return {
        "name": [printable(name) for name in rows["name"]],
        "step": rows["step"],
        "action": rows["action"],
        "value": np.asarray(rows["value"]),
    }
