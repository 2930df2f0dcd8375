"""Scores as tables for people."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import Group
from rich.table import Table

from real_bench.lengths import TRIAL_STEPS
from real_bench.scoring.columns import drop_empty_columns
from real_bench.scoring.comparison import Comparison
from real_bench.scoring.metric import METRICS, SCORE
from real_bench.scoring.parts import describe_part, describe_play, describe_sum, warn_of_few
from real_bench.scoring.result import Result, Setting
from real_bench.scoring.sides import MAX_LENGTH, NAMES, distinguishing, remarks
from real_bench.scoring.statistics import OVER_GOALS, interval_heading
from real_bench.scoring.summary import TOTAL, ClassSummary, summarise
from real_bench.text.counting import counted
from real_bench.text.quoting import quoted


def score_columns(result: Result) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of a score table: one row per class that has goals, and the total last.

    The columns are class, goals, and every known metric; the score has its interval.
    """
    metrics = []
    for name, metric in METRICS.items():
        metrics += [metric.title, interval_heading(OVER_GOALS)] if name == SCORE else [metric.title]
    rows = [_cells(row, result) for row in summarise(result.trials)]
    return drop_empty_columns(["class", "goals", *metrics], rows)


def describe_test(setting: Setting) -> str:
    """What was tested after which play."""
    objects = counted(setting.objects, "object")
    sentence = f"{setting.controller} in REAL_{setting.condition}, {objects}, scene {setting.scene}"
    short = setting.trial_steps != TRIAL_STEPS
    length = f", trials of {setting.trial_steps:,} steps instead of {TRIAL_STEPS:,}" * short
    return f"{sentence}, {describe_play(setting)}{length}"


def score_table(result: Result) -> Group:
    """What was tested, and a table of the classes of goals and the total."""
    table = _narrow_table()
    headings, rows = score_columns(result)
    for number, heading in enumerate(headings):
        table.add_column(heading, justify="right" if number else "left")
    for cells in rows:
        if cells[0] == TOTAL:
            table.add_section()
        table.add_row(*cells)
    notes = [
        *describe_part([result]),
        *describe_sum(result.setting.objects),
        *warn_of_few(len(result.trials)),
    ]
    return Group(describe_test(result.setting), table, *notes)


def comparison_table(comparison: Comparison, a: Sequence[Result], b: Sequence[Result]) -> Group:
    """What A and B are, a table of every goal, and both compared in every metric."""
    settings = a[0].setting, b[0].setting
    sides = [
        f"{name}: {quoted(describe_test(one), MAX_LENGTH)}"
        + (f", {differs}" if (differs := distinguishing(one, other)) else "")
        for name, one, other in zip(NAMES, settings, settings[::-1], strict=True)
    ]
    interval = comparison.score.interval
    over = interval_heading(interval.over if interval else OVER_GOALS)
    sums = _narrow_table()
    sums.add_column("metric")
    for heading in ("A", "B", "A - B", over, "A better", interval_heading(OVER_GOALS)):
        sums.add_column(heading, justify="right")
    for name, metric in METRICS.items():
        found = comparison.metrics[name]
        if found.to_json() is None:
            continue
        sums.add_row(
            metric.title,
            metric.text(found.a),
            metric.text(found.b),
            metric.change(found.difference),
            metric.interval(found.interval),
            "-" if found.improvement is None else f"{found.improvement:.2f}",
            str(found.improvement_interval or "-"),
        )
    table = _narrow_table()
    for heading in ("goal set", "goal", "class"):
        table.add_column(heading)
    for heading in ("score of A", "of B", "A - B"):
        table.add_column(heading, justify="right")
    for goal in comparison.goals:
        scores = (f"{goal.a:.3f}", f"{goal.b:.3f}", f"{goal.difference:+.3f}")
        table.add_row(goal.goals_sha256[:8], str(goal.goal), goal.challenge, *scores)
    tested = " and ".join(
        f"{name} {counted(times, 'time')} after {counted(plays, 'play')}"
        if plays != times
        else f"{name} {counted(times, 'time')}"
        for name, times, plays in zip(NAMES, comparison.n_repeats, comparison.n_plays, strict=True)
    )
    sentence = (
        f"tested on the same {counted(len(comparison.goals), 'goal')}: {tested}. A better: "
        "probability on a goal, a tie counts half; its interval is for other goals, after these "
        "plays."
    )
    return Group(*sides, table, sums, sentence, *remarks(comparison, a, b))


def _narrow_table() -> Table:
    """A table whose numbers stay on one line on a terminal of 80 columns."""
    return Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)


def _cells(row: ClassSummary, result: Result) -> list[str]:
    metrics = []
    for name, metric in METRICS.items():
        mean = row.means[name]
        metrics.append(metric.text(mean.value))
        if name == SCORE:
            metrics.append(metric.interval(mean.interval))
    is_part = row.name == TOTAL and not result.is_complete
    goals = f"{row.n_goals} of {result.setting.set_size}" if is_part else str(row.n_goals)
    return [row.name, goals, *metrics]
