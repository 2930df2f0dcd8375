"""How far actions move objects (paper, fig. HistActions)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from real_bench.analysis import NEAR_M, Floats, action_lengths
from real_bench.figures import style
from real_bench.figures.drawing import Drawing, Numbers

if TYPE_CHECKING:
    from real_bench.figures.data import FigureData

HEIGHT_CM = 5.6
BIN_M = 0.02


def draw(data: FigureData) -> Drawing | None:
    """A histogram of the actions that moved an object by more than 1 cm."""
    lengths = {play.label: action_lengths(play.displacements) for play in data.plays}
    lengths = {label: far for label, far in lengths.items() if len(far)}
    if not lengths:
        return None
    n_bins = math.ceil(max(far[-1] for far in lengths.values()) / BIN_M)
    edges = BIN_M * np.arange(n_bins + 1)
    tables = []
    with style.in_style():
        figure, (panel,) = style.panels(1, HEIGHT_CM)
        outlines = []
        for number, (label, far) in enumerate(lengths.items()):
            line_style = style.line_style(number)
            counts = np.histogram(far, edges)[0]
            legend = f"{label}: {share_near(far):.0%} below 20 cm"
            steps = panel.stairs(counts, 100 * edges, linewidth=1.2, label=legend)
            steps.set(edgecolor=line_style.colour, linestyle=line_style.line)
            outlines.append(steps)
            rows = {"cm_from": 100 * edges[:-1], "cm_to": 100 * edges[1:], "actions": counts}
            tables.append(({"recording": label}, rows))
        panel.axvline(100 * NEAR_M[1], color=style.GREY, linewidth=0.8, linestyle="-.")
        panel.set_xlabel("length of action (cm)")
        panel.set_xlim(left=0)
        panel.set_ylabel(f"actions per {100 * BIN_M:.0f} cm")
        style.show_counts_on_y(panel)
        style.add_legend_below(figure, outlines)
    return Drawing(figure, Numbers.stacked(tables))


def share_near(lengths: Floats) -> float:
    """The share of actions that are shorter than 20 cm; NaN without actions."""
    return float(np.mean(lengths < NEAR_M[1])) if len(lengths) else math.nan
