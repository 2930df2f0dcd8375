"""The score table, as a person reads it."""

from __future__ import annotations

from rich.table import Table

from real_bench.scoring.result import Result
from real_bench.scoring.summary import TOTAL, ClassSummary


def score_table(result: Result) -> Table:
    """A table of the classes of goals and the total."""
    setting = result.setting
    learned = f"after {setting.run_steps:,} steps of play" if setting.run_steps else "without play"
    table = Table(
        title=f"{setting.controller} in REAL_{setting.condition}, {setting.objects} object(s), "
        f"scene {setting.scene}, {learned}"
    )
    table.add_column("class")
    for heading in ("goals", "mean score", "95% interval", "distance (m)"):
        table.add_column(heading, justify="right")
    for row in result.summary():
        if row.name == TOTAL:
            table.add_section()
        table.add_row(*_cells(row))
    return table


def _cells(row: ClassSummary) -> tuple[str, ...]:
    interval = f"{row.interval.low:.3f} to {row.interval.high:.3f}" if row.interval else "-"
    return (row.name, str(row.n_goals), f"{row.score:.3f}", interval, f"{row.distance:.3f}")
