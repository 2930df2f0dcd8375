"""Scores as a person reads them."""

from __future__ import annotations

from rich.console import Group
from rich.table import Table

from real_bench.scoring.comparison import Comparison
from real_bench.scoring.result import Result
from real_bench.scoring.summary import TOTAL, ClassSummary

NONE = "-"


def score_table(result: Result) -> Group:
    """What was tested, and a table of the classes of goals and the total."""
    setting = result.setting
    objects = "1 object" if setting.objects == 1 else f"{setting.objects} objects"
    learned = f"after {setting.run_steps:,} steps of play" if setting.run_steps else "without play"
    told = f"{setting.controller} in REAL_{setting.condition}, {objects}, scene {setting.scene}"
    table = Table()
    table.add_column("class")
    for heading in ("goals", "mean score", "95% interval", "distance (m)"):
        table.add_column(heading, justify="right")
    for row in result.summary():
        if row.name == TOTAL:
            table.add_section()
        table.add_row(*_cells(row))
    return Group(f"{told}, {learned}", table)


def comparison_table(comparison: Comparison) -> Group:
    """What A and B are together, and a table of every goal."""
    told = [
        f"A {comparison.a:.3f}, B {comparison.b:.3f} ({comparison.n_repeats[0]} and "
        f"{comparison.n_repeats[1]} repeats on {len(comparison.goals)} goals)",
        f"A - B {comparison.difference:+.3f}, 95% interval {comparison.interval or NONE}",
        f"A scores more on a goal with probability {comparison.improvement:.2f}, "
        f"95% interval {comparison.improvement_interval or NONE}",
    ]
    table = Table()
    for heading in ("goal set", "goal", "class"):
        table.add_column(heading)
    for heading in ("A", "B", "A - B"):
        table.add_column(heading, justify="right")
    for goal in comparison.goals:
        scores = (f"{goal.a:.3f}", f"{goal.b:.3f}", f"{goal.difference:+.3f}")
        table.add_row(goal.goals_sha256[:8], str(goal.goal), goal.challenge, *scores)
    return Group(table, *told)


def _cells(row: ClassSummary) -> tuple[str, ...]:
    interval = str(row.interval or NONE)
    return (row.name, str(row.n_goals), f"{row.score:.3f}", interval, f"{row.distance:.3f}")
