"""The table of an experiment: as text, Markdown, LaTeX and JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich import box
from rich.table import Table

from real_bench.experiments.scores import Row
from real_bench.experiments.spec import Published, Spec
from real_bench.goal_sets.goal import CHALLENGES
from real_bench.physics import mixture
from real_bench.quoting import markdown, quoted
from real_bench.scoring.metric import METRICS, SCORE
from real_bench.scoring.repeats import ENOUGH_REPEATS
from real_bench.scoring.statistics import (
    LEAST_PLAYS,
    OVER_PLAYS_AND_GOALS,
    Interval,
    interval_heading,
)

OVER = interval_heading(OVER_PLAYS_AND_GOALS)
LEGEND = (
    f"s.e.: standard error over repeats; {OVER}: how far the mean would go if all was done again, "
    f"which fewer than {LEAST_PLAYS} plays do not tell; IQM: interquartile mean"
)
FEW, UNLIKE, MIXED = "*", "†", "‡"
LONGEST = 1000
ABSENT = "-"


def headings() -> list[str]:
    """Of the columns; beside the score, the metrics that are shown where room is short."""
    return [
        *("controller", "condition", "objects", "repeats", "goals"),
        *("mean ± s.e.", OVER, "IQM", *CHALLENGES),
        *(METRICS[name].title for name in _others()),
        *("published", "difference"),
    ]


def text_table(spec: Spec, rows: Sequence[Row]) -> Table:
    """For a terminal."""
    table = Table(
        title=quoted(spec.title),
        caption="\n".join(notes(rows)),
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    for number, heading in enumerate(headings()):
        table.add_column(heading, justify="left" if number < 2 else "right")
    for row in rows:
        table.add_row(*cells(row))
    return table


def markdown_table(spec: Spec, rows: Sequence[Row]) -> str:
    """For a README or a job summary."""
    from tabulate import tabulate

    shown = [(markdown(name), *numbers) for name, *numbers in map(cells, rows)]
    table = tabulate(shown, headings(), "github", disable_numparse=True)
    below = "".join(f"\n{markdown(note)}  " for note in notes(rows))
    return f"### {markdown(spec.title)}\n\n{table}\n{below}"


def latex_table(spec: Spec, rows: Sequence[Row]) -> str:
    """For a paper that uses booktabs."""
    from tabulate import tabulate

    table = tabulate(
        [cells(row) for row in rows], headings(), "latex_booktabs", disable_numparse=True
    )
    remarks = "".join(f"% {quoted(note, LONGEST)}\n" for note in (spec.title, *notes(rows)))
    return remarks + table.replace("±", r"$\pm$")


def json_table(spec: Spec, rows: Sequence[Row]) -> dict[str, Any]:
    """Every number, and what each is of."""
    return {
        "title": spec.title,
        "scene": spec.scene,
        "steps": spec.steps,
        "trial_steps": spec.trial_steps,
        "rows": [row.to_json() for row in rows],
    }


def cells(row: Row) -> list[str]:
    """What stands in each column."""
    cell, summary = row.cell, row.summary
    done = f"{len(row.seeds)} of {row.n_asked}{MIXED if mixture(row.physics) else ''}"
    told = [
        row.label,
        cell.condition,
        str(cell.objects),
        done,
    ]
    numbers = [ABSENT] * (4 + len(CHALLENGES) + len(_others()))
    if summary is not None:
        score = summary.score
        numbers = [
            str(summary.n_goals),
            _with_error(score.mean, score.standard_error),
            _interval(score.interval),
            f"{score.interquartile_mean:.3f}",
            *(_number(score.by_class.get(name)) for name in CHALLENGES),
            *(METRICS[name].text(summary.metrics[name].mean) for name in _others()),
        ]
    unlike = UNLIKE if row.unlike_published else ""
    few = "" if row.is_enough or row.difference is None else FEW
    difference = ABSENT if row.difference is None else f"{row.difference:+.3f}{few}{unlike}"
    return [*told, *numbers, f"{_published(cell.published)}{unlike}", difference]


def notes(rows: Sequence[Row]) -> list[str]:
    """What is to be said below the table."""
    missing = sum(row.n_asked - len(row.seeds) for row in rows)
    told = [
        LEGEND,
        *(f"{row.cell.name}: {quoted(row.cell.note, LONGEST)}" for row in rows if row.cell.note),
    ]
    if any(row.difference is not None and not row.is_enough for row in rows):
        told.append(f"{FEW} fewer than {ENOUGH_REPEATS} plays: too few to compare")
    for reason in dict.fromkeys(reason for row in rows for reason in row.unlike_published):
        told.append(f"{UNLIKE} not what was published: {reason}")
    if earlier := [row.cell.name for row in rows if row.is_of_earlier_control]:
        told.append(
            f"by an earlier version of their control (macros did not end exactly at their second "
            f"point): {', '.join(earlier)}"
        )
    if told_of_physics := mixture([each for row in rows for each in row.physics]):
        told.append(f"{MIXED} {told_of_physics}")
    if missing:
        asked = sum(row.n_asked for row in rows)
        told.append(f"{missing} of {asked} repeats are missing")
    return told


def _others() -> list[str]:
    """The metrics beside the score that are shown where room is short."""
    return [name for name, metric in METRICS.items() if metric.narrow and name != SCORE]


def _interval(interval: Interval | None) -> str:
    over_plays = interval is not None and interval.over == OVER_PLAYS_AND_GOALS
    return str(interval) if over_plays else ABSENT


def _with_error(mean: float, error: float | None) -> str:
    return f"{mean:.3f}" if error is None else f"{mean:.3f} ± {error:.3f}"


def _published(published: Published | None) -> str:
    if published is None:
        return ABSENT
    return _with_error(published.mean, published.standard_error)


def _number(value: float | None) -> str:
    return ABSENT if value is None else f"{value:.3f}"
