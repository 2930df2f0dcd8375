"""The score table, as a person reads it."""

from __future__ import annotations

from rich.console import Group
from rich.table import Table

from real_bench.scoring.result import Result
from real_bench.scoring.summary import TOTAL, ClassSummary


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


def _cells(row: ClassSummary) -> tuple[str, ...]:
    interval = f"{row.interval.low:.3f} to {row.interval.high:.3f}" if row.interval else "-"
    return (row.name, str(row.n_goals), f"{row.score:.3f}", interval, f"{row.distance:.3f}")
