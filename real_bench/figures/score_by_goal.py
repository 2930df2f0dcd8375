"""The score of each goal (paper, fig. REAL-RM-scores and REAL-RJ-scores)."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from real_bench.analysis import Floats
from real_bench.figures import style
from real_bench.figures.drawing import Column, Drawing, Numbers
from real_bench.goal_sets.goal import CHALLENGES
from real_bench.text.counting import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from real_bench.figures.data import FigureData
    from real_bench.figures.tested import Series

PANEL_HEIGHT_CM = 4.4
TICK_EVERY_GOAL = 20
"""So many are all numbered; of more, each fifth."""

LETTERS_IN_LINE, LETTERS_OF_SIGN = 105, 4
"""What fits above a panel: a controller's name, and its conditions with their signs."""

SPREAD = 0.5
"""The share of a goal's width on the x axis that its scores take."""


def draw(data: FigureData) -> Drawing | None:
    """A panel per controller, its conditions side by side; after the longest play of each."""
    shown = _after_longest_play(data.series)
    if not shown:
        return None
    trials = shown[0].results[0].trials
    order = sorted(
        range(len(trials)), key=lambda i: (CHALLENGES.index(trials[i].challenge), trials[i].goal)
    )
    goals = [trials[i].goal for i in order]
    classes = [trials[i].challenge for i in order]
    controllers = list(dict.fromkeys(one.controller for one in shown))
    conditions = sorted({one.condition for one in shown})
    tables = []
    with style.in_style():
        own_of = {name: [one for one in shown if one.controller == name] for name in controllers}
        lines_of = {name: _legend_lines(name, own) for name, own in own_of.items()}
        height = PANEL_HEIGHT_CM + (max(lines_of.values()) - 1) * style.LEGEND_ROW_CM
        figure, axes = style.rows(len(controllers), height)
        for panel, (controller, own) in zip(axes, own_of.items(), strict=True):
            below = lines_of[controller]
            pad = (
                style.TITLE_PAD + (below > 1) * (below - 0.5) * style.LEGEND_ROW_CM * style.CM * 72
            )
            panel.set_title(textwrap.fill(controller, LETTERS_IN_LINE), loc="left", pad=pad)
            for number, one in enumerate(own):
                x = np.arange(0.0, len(goals)) + SPREAD * ((number + 0.5) / len(own) - 0.5)
                scores = one.by_goal[order]
                _draw(panel, x, scores, one, style.line_style(conditions.index(one.condition)))
                tables.append(_rows(one, goals, classes, scores))
            panel.legend(
                loc="lower right",
                bbox_to_anchor=(1, 1),
                borderaxespad=0.2,
                ncols=1 if below > 1 else len(own),
                handlelength=1,
            )
            panel.set_ylim(0, 1.12 * shown[0].results[0].setting.objects)
            _divide(panel, goals, classes)
        axes[-1].set_xlabel("goal")
    return Drawing(figure, Numbers.stacked(tables))


def _after_longest_play(series: Sequence[Series]) -> list[Series]:
    """Of tests that differ only in the length of play, the one after the longest."""
    longest: dict[tuple[str, str], Series] = {}
    for one in sorted(series, key=lambda one: one.run_steps):
        longest[one.controller, one.condition] = one
    return [one for one in series if one is longest[one.controller, one.condition]]


def _legend_lines(controller: str, own: Sequence[Series]) -> int:
    """How many lines its conditions take: one, beside its name, if there is room."""
    captions = [_caption(one, one.by_goal) for one in own]
    letters = sum(len(each) + LETTERS_OF_SIGN for each in (controller, *captions))
    return 1 if letters <= LETTERS_IN_LINE else max(2, len(own))


def _caption(one: Series, scores: Floats) -> str:
    share = "" if one.results[0].is_complete else f" ({one.results[0].share})"
    length = f"after {one.run_steps / style.MILLION:g}M steps" if one.run_steps else "without play"
    runs = counted(len(one.results), "run")
    return f"{one.condition} {length}: mean {scores.mean():.3f}{share}, {runs}"


def _draw(panel: Axes, x: Floats, scores: Floats, one: Series, line_style: style.LineStyle) -> None:
    panel.vlines(x, 0, scores, color=line_style.colour, linewidth=0.8)
    panel.plot(
        x,
        scores,
        line_style.marker,
        color=line_style.colour,
        label=_caption(one, scores),
        clip_on=False,
        zorder=3,
    )
    panel.set_ylabel("score")


def _divide(panel: Axes, goals: Sequence[int], classes: Sequence[str]) -> None:
    """Set the classes apart, and name them."""
    begin = 0
    for number, (challenge, members) in enumerate(groupby(classes)):
        end = begin + len(list(members))
        if number % 2:
            panel.axvspan(begin - 0.5, end - 0.5, color="0.92", linewidth=0, zorder=0)
        middle, above = (begin + end - 1) / 2, panel.get_ylim()[1] * 0.97
        panel.text(middle, above, challenge, ha="center", va="top")
        begin = end
    ticks = range(0, len(goals), 5 if len(goals) > TICK_EVERY_GOAL else 1)
    panel.set_xticks(ticks, [str(goals[i]) for i in ticks])
    panel.set_xlim(-0.75, len(goals) - 0.25)


def _rows(
    one: Series, goals: Sequence[int], classes: Sequence[str], scores: Floats
) -> tuple[dict[str, str | int], dict[str, Column]]:
    same: dict[str, str | int] = {
        "controller": one.controller,
        "condition": one.condition,
        "run_steps": one.run_steps,
        "runs": len(one.results),
    }
    return same, {"goal": goals, "class": classes, "score": scores}
