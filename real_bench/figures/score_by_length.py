"""Score against the length of the intrinsic phase (paper, fig. real-score-over-time)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from real_bench.analysis import score_by_length
from real_bench.figures import style
from real_bench.figures.drawing import Column, Drawing, Numbers
from real_bench.scoring.statistics import OVER_GOALS, goals_interval, interval_heading

if TYPE_CHECKING:
    from real_bench.figures.data import FigureData
    from real_bench.figures.tested import Series

HEIGHT_CM = 5.6


def draw(data: FigureData) -> Drawing | None:
    """A line per controller and condition that was tested after different lengths of play.

    Bars are 95% intervals over goals, after the plays of that length; no bar where there is none.
    """
    lines: dict[tuple[str, str], list[Series]] = {}
    for one in sorted(data.series, key=lambda one: one.run_steps):
        lines.setdefault((one.controller, one.condition), []).append(one)
    lines = {who: tests for who, tests in lines.items() if len(tests) > 1}
    if not lines:
        return None
    tables = []
    with style.in_style():
        figure, (panel,) = style.panels(1, HEIGHT_CM)
        bars = []
        for number, ((controller, condition), tests) in enumerate(lines.items()):
            rows, line_style = _rows(tests), style.line_style(number)
            steps = np.asarray(rows["run_steps"]) / style.MILLION
            means = np.asarray(rows["score"])
            bar = panel.errorbar(
                steps,
                means,
                [means - rows["goals_interval_low"], rows["goals_interval_high"] - means],
                fmt=line_style.line + line_style.marker,
                color=line_style.colour,
                capsize=2,
                elinewidth=0.8,
                label=f"{controller} {condition}{_part(tests[0])}",
            )
            bars.append(bar)
            tables.append(({"controller": controller, "condition": condition}, rows))
        panel.set_xlabel("length of the intrinsic phase (million steps)")
        panel.set_ylabel(f"score (mean, {interval_heading(OVER_GOALS)})")
        panel.set_xlim(
            0,
            1.05 * max(one.run_steps for tests in lines.values() for one in tests) / style.MILLION,
        )
        panel.set_ylim(bottom=0)
        style.add_legend_below(figure, bars)
    return Drawing(figure, Numbers.stacked(tables))


def _part(series: Series) -> str:
    """How much of the goal set was tested, if not all of it."""
    first = series.results[0]
    return "" if first.is_complete else f" ({first.share})"


def _rows(tests: list[Series]) -> dict[str, Column]:
    """One row per length."""
    lengths, means = score_by_length([result for test in tests for result in test.results])
    intervals = [goals_interval(test.by_goal, test.classes) for test in tests]
    return {
        "run_steps": lengths,
        "runs": [len(test.results) for test in tests],
        "score": means,
        "goals_interval_low": [i.low if i else np.nan for i in intervals],
        "goals_interval_high": [i.high if i else np.nan for i in intervals],
    }
