"""The table of an experiment: as text, Markdown, LaTeX and JSON."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

from rich import box
from rich.console import Console, Group
from rich.measure import Measurement
from rich.table import Table

from real_bench.experiments.scores import Row
from real_bench.experiments.spec import Published, Spec
from real_bench.goal_sets.goal import CHALLENGES
from real_bench.physics import mixture
from real_bench.scoring.columns import ABSENT, drop_empty_columns
from real_bench.scoring.metric import METRICS, SCORE
from real_bench.scoring.parts import describe_sum
from real_bench.scoring.repeats import ENOUGH_PLAYS
from real_bench.scoring.statistics import (
    MIN_PLAYS,
    OVER_PLAYS_AND_GOALS,
    Interval,
    interval_heading,
)
from real_bench.text.naming import scene_name
from real_bench.text.quoting import markdown, quoted

OVER = interval_heading(OVER_PLAYS_AND_GOALS)
KEYS, MEAN = ("controller", "condition", "objects"), "mean ± s.e."
LEGEND = {
    MEAN: "s.e.: standard error over plays",
    OVER: f"{OVER}: of the mean of many plays on many such goals; needs {MIN_PLAYS} plays",
    "IQM": "IQM: interquartile mean",
}
"""Explanations of columns."""
PLUS_MINUS = r"$\pm$"
LATEX_NOTES = "\\par\\smallskip\n{\\footnotesize\\raggedright\\setlength{\\parindent}{0pt}\n"
FEW, UNLIKE, MIXED = "*", "†", "‡"
MAX_LENGTH = 1000
MAX_HEADING_WIDTH, MAX_NAME_WIDTH = 14, 18
MAX_TABLE_WIDTH = 100
"""The widest table, in characters."""


def columns(rows: Sequence[Row]) -> tuple[list[str], list[list[str]]]:
    """Headings and cells of the columns in which any row has something.

    Beside the score stand only the metrics that are shown where room is short.
    """
    headings = [
        *(*KEYS, "repeats", "goals"),
        *(MEAN, OVER, "IQM", *CHALLENGES),
        *(METRICS[name].title for name in _secondary_metrics()),
        *("published", "difference"),
    ]
    return drop_empty_columns(
        headings, [cells(row) for row in rows], always=(*KEYS, "repeats", MEAN)
    )


def text_table(spec: Spec, rows: Sequence[Row]) -> Group:
    """For a terminal; a table too wide for most terminals is split in two."""
    headings, shown = columns(rows)
    whole = _text_table(headings, shown)
    if _width(whole) <= MAX_TABLE_WIDTH:
        return Group(quoted(spec.title), "", whole, "", *notes(spec, rows))
    first = [*KEYS, "repeats", MEAN, OVER, "published", "difference"]
    others = [heading for heading in headings if heading in KEYS or heading not in first]
    tables = [_text_table(*_select_columns(part, headings, shown)) for part in (first, others)]
    return Group(quoted(spec.title), "", tables[0], "", tables[1], "", *notes(spec, rows))


def markdown_table(spec: Spec, rows: Sequence[Row]) -> str:
    """For a README or a job summary."""
    from tabulate import tabulate

    headings, shown = columns(rows)
    escaped = [(markdown(name), *numbers) for name, *numbers in shown]
    table = tabulate(escaped, headings, "github", disable_numparse=True)
    below = "".join(f"\n{markdown(note)}  " for note in notes(spec, rows))
    return f"### {markdown(spec.title)}\n\n{table}\n{below}"


def latex_table(spec: Spec, rows: Sequence[Row]) -> str:
    """For a paper that uses booktabs; the notes stand below the table."""
    from tabulate import tabulate

    headings, shown = columns(rows)
    table = tabulate(shown, headings, "latex_booktabs", disable_numparse=True)
    remarks = "\n\n".join(_latex(note) for note in notes(spec, rows))
    below = f"{LATEX_NOTES}{remarks}\\par}}"
    return f"% {quoted(spec.title, MAX_LENGTH)}\n{table.replace('±', PLUS_MINUS)}\n{below}"


def _latex(note: str) -> str:
    """A note as one line that LaTeX shows literally."""
    from tabulate import LATEX_ESCAPE_RULES

    rules = {**LATEX_ESCAPE_RULES, "±": PLUS_MINUS}
    return "".join(rules.get(letter, letter) for letter in quoted(note, MAX_LENGTH))


def json_table(spec: Spec, rows: Sequence[Row]) -> dict[str, Any]:
    """Every number, with what it belongs to."""
    return {
        "title": spec.title,
        "scene": spec.scene,
        "steps": spec.steps,
        "trial_steps": spec.trial_steps,
        "rows": [row.to_json() for row in rows],
        "notes": notes(spec, rows),
    }


def cells(row: Row) -> list[str]:
    """The text of each column."""
    cell, summary = row.cell, row.summary
    done = f"{len(row.seeds)} of {row.n_asked}{MIXED if mixture(row.physics) else ''}"
    lines = [
        row.label,
        cell.condition,
        str(cell.objects),
        done,
    ]
    numbers = [ABSENT] * (4 + len(CHALLENGES) + len(_secondary_metrics()))
    if summary is not None:
        score = summary.score
        numbers = [
            str(summary.n_goals),
            _with_error(score.mean, score.standard_error),
            _interval(score.interval),
            f"{score.interquartile_mean:.3f}",
            *(_number(score.by_class.get(name)) for name in CHALLENGES),
            *(METRICS[name].text(summary.metrics[name].mean) for name in _secondary_metrics()),
        ]
    unlike = UNLIKE if row.unlike_published else ""
    few = "" if row.is_enough or row.difference is None else FEW
    difference = ABSENT if row.difference is None else f"{row.difference:+.3f}{few}{unlike}"
    return [*lines, *numbers, f"{_published(cell.published)}{unlike}", difference]


def notes(spec: Spec, rows: Sequence[Row]) -> list[str]:
    """The notes below the table."""
    missing = sum(row.n_asked - len(row.seeds) for row in rows)
    lines = [
        _describe_task(spec, rows),
        *_describe_goals(spec, rows),
        "; ".join(LEGEND[heading] for heading in columns(rows)[0] if heading in LEGEND),
        *(f"{row.cell.name}: {quoted(row.cell.note, MAX_LENGTH)}" for row in rows if row.cell.note),
    ]
    for n_objects in sorted({row.cell.objects for row in rows}):
        lines += describe_sum(n_objects)
    if any(row.difference is not None and not row.is_enough for row in rows):
        lines.append(f"{FEW} fewer than {ENOUGH_PLAYS} plays: too few to compare")
    for reason in dict.fromkeys(reason for row in rows for reason in row.unlike_published):
        lines.append(f"{UNLIKE} not what was published: {reason}")
    if earlier := [row.cell.name for row in rows if row.is_of_earlier_control]:
        lines.append(
            f"made with an earlier version of the control (macros did not end exactly at their "
            f"second point): {', '.join(earlier)}"
        )
    if mixed := [row.cell.name for row in rows if len(set(row.sources)) > 1]:
        lines.append(
            "averages over results of different code of realbench, whose own controllers may have "
            f"changed in between: {', '.join(mixed)}"
        )
    if physics_note := mixture([each for row in rows for each in row.physics]):
        within_a_row = any(mixture(row.physics) for row in rows)
        lines.append(f"{MIXED} {physics_note}" if within_a_row else physics_note)
    if missing:
        wanted = sum(row.n_asked for row in rows)
        lines.append(f"{missing} of {wanted} repeats are missing")
    return lines


def _describe_task(spec: Spec, rows: Sequence[Row]) -> str:
    scene = quoted(scene_name(spec.scene))
    unplayed = [row.cell.name for row in rows if spec.play_of(row.cell) is None]
    none = f" (none in {', '.join(unplayed)})" if unplayed else ""
    return (
        f"scene {scene}, {spec.steps:,} steps of play{none}, trials of {spec.trial_steps:,} steps; "
        f"repeats are seeds from {spec.seed} on (--json says which)"
    )


def _describe_goals(spec: Spec, rows: Sequence[Row]) -> list[str]:
    """A line if rows are of different goals."""
    cells: dict[tuple[str, ...], list[str]] = {}
    for row in rows:
        if row.summary is not None:
            cells.setdefault(tuple(spec.goal_names(row.cell)), []).append(row.cell.name)
    if len(cells) < 2:
        return []
    usual, *others = sorted(cells, key=lambda goals: -len(cells[goals]))
    told = "; ".join(f"{', '.join(goals)} in {', '.join(cells[goals])}" for goals in others)
    return [f"rows of different goals compare only roughly: {', '.join(usual)}; but {told}"]


def _text_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, padding=0, show_edge=False)
    for heading in headings:
        broken = "\n".join(textwrap.wrap(heading, MAX_HEADING_WIDTH))
        left = heading in KEYS[:2]
        # long names wrap, so that no number does
        longest = MAX_NAME_WIDTH if heading == KEYS[0] else None
        table.add_column(
            broken, justify="left" if left else "right", overflow="fold", max_width=longest
        )
    for row in rows:
        table.add_row(*row)
    return table


def _width(table: Table) -> int:
    """Its width in characters where there is room."""
    console = Console(width=10 * MAX_TABLE_WIDTH)
    return Measurement.get(console, console.options, table).maximum


def _select_columns(
    wanted: Sequence[str], headings: Sequence[str], rows: Sequence[Sequence[str]]
) -> tuple[list[str], list[list[str]]]:
    """Those of the columns that are wanted."""
    numbers = [headings.index(heading) for heading in wanted if heading in headings]
    return [headings[number] for number in numbers], [[row[n] for n in numbers] for row in rows]


def _secondary_metrics() -> list[str]:
    """The metrics besides the score that are shown where room is short."""
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
