"""Effective actions and thresholds by level of abstraction (paper, fig. EffectiveActions)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from real_bench import palette
from real_bench.analysis import effective_actions, levels_below
from real_bench.figures import style
from real_bench.figures.drawing import Column, Drawing, Numbers
from real_bench.real_x import DynamicAbstraction
from real_bench.recording import MOVED_M

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

    from real_bench.figures.data import FigureData

PANEL_HEIGHT_CM = 5.6
HEADROOM = 1.3
"""Height of a panel relative to the line of actions, to leave room for a note."""


@dataclass(frozen=True, eq=False)
class Levels:
    """Levels of abstraction of one recording.

    Attributes:
        label: the recording's.
        variables: names of the V variables.
        counts: how many actions are effective at each level, (L,).
        abstraction: the levels.
    """

    label: str
    variables: tuple[str, ...]
    counts: NDArray[np.int64]
    abstraction: DynamicAbstraction


def of_positions(data: FigureData) -> Drawing | None:
    """Of REAL-D, which plans with x and y of the objects."""
    parts = []
    for play in data.plays:
        if len(play.places):
            abstraction = play.abstraction(play.places)
            counts = effective_actions(play.places, abstraction)
            variables = tuple(
                f"{name} {axis}" for name in play.header.object_names for axis in "xy"
            )
            parts.append(Levels(play.label, variables, counts, abstraction))
    return _draw_levels(parts, in_metres=True)


def of_codes(data: FigureData) -> Drawing | None:
    """Of REAL-LD, which plans with latent variables."""
    parts = []
    for play in data.plays:
        if play.sight is not None:
            codes = play.sight.codes
            abstraction = play.abstraction(codes)
            counts = effective_actions(codes, abstraction)
            variables = tuple(f"latent {number}" for number in range(codes.n_variables))
            parts.append(Levels(play.label, variables, counts, abstraction))
    return _draw_levels(parts, in_metres=False)


def passes_1_cm(abstraction: DynamicAbstraction) -> int:
    """The first level, from 0, at which a threshold is 1 cm or more; L if there is none."""
    return int(levels_below(abstraction, MOVED_M).min())


def _draw_levels(parts: list[Levels], *, in_metres: bool) -> Drawing | None:
    if not parts:
        return None
    scale, unit = (100, "cm") if in_metres else (1, "latent units")
    with style.in_style():
        figure, axes = style.panels(len(parts), PANEL_HEIGHT_CM)
        for panel, levels in zip(axes, parts, strict=True):
            right = panel.twinx()
            lines = _draw_counts(panel, levels) + _draw_thresholds(right, levels, scale)
            right.set_ylabel(f"threshold ({unit}, dashed)")
            if in_metres:
                _mark_1_cm(panel, levels)
        style.add_legend_below(figure, lines)
    column = f"threshold_{unit.replace(' ', '_')}"
    return Drawing(figure, Numbers.stacked([_rows(levels, scale, column) for levels in parts]))


def _draw_counts(panel: Axes, levels: Levels) -> list[Line2D]:
    panel.set_title(style.title(levels.label))
    panel.set_xlabel("level of abstraction")
    panel.set_ylabel("effective actions (solid)")
    panel.set_xlim(0, levels.abstraction.n_levels - 1)
    lines = panel.plot(levels.counts, "-", color=palette.BLUE, label="effective actions")
    panel.set_ylim(top=HEADROOM * levels.counts.max(initial=1))
    style.show_counts_on_y(panel)
    return lines


def _draw_thresholds(panel: Axes, levels: Levels, scale: float) -> list[Line2D]:
    """The least and the largest of the variables' thresholds, and what is between."""
    thresholds = scale * levels.abstraction.thresholds
    least, largest = thresholds.min(axis=1), thresholds.max(axis=1)
    every = np.arange(len(thresholds))
    panel.fill_between(every, least, largest, color=palette.ORANGE, alpha=0.2, linewidth=0)
    lines = panel.plot(largest, "--", color=palette.ORANGE, label="largest threshold")
    lines += panel.plot(least, ":", color=palette.ORANGE, label="least threshold")
    panel.set_ylim(bottom=0)
    return lines


def _mark_1_cm(panel: Axes, levels: Levels) -> None:
    level, n_levels = passes_1_cm(levels.abstraction), levels.abstraction.n_levels
    if level == n_levels:
        return
    is_right = level > n_levels / 2
    panel.axvline(level, color=style.GREY, linestyle="-.", linewidth=0.8)
    panel.annotate(
        f"1 cm at level {level}:\n{levels.counts[level]:,} actions",
        (level, 0.97),
        xycoords=("data", "axes fraction"),
        xytext=(-3 if is_right else 3, 0),
        textcoords="offset points",
        horizontalalignment="right" if is_right else "left",
        verticalalignment="top",
    )


def _rows(levels: Levels, scale: float, column: str) -> tuple[dict[str, str], dict[str, Column]]:
    """One row per level and variable."""
    n_levels, n_variables = levels.abstraction.thresholds.shape
    columns: dict[str, Column] = {
        "level": np.repeat(np.arange(n_levels), n_variables),
        "effective_actions": np.repeat(levels.counts, n_variables),
        "variable": levels.variables * n_levels,
        column: scale * levels.abstraction.thresholds.ravel(),
    }
    return {"recording": levels.label}, columns
