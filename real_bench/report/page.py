"""Put a report's parts into one HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from real_bench.files.atomic import write_atomically
from real_bench.report.html import packaged_text, render_html
from real_bench.report.parts import RecordingEntry, ResultEntry
from real_bench.scoring.parts import describe_play, describe_sum
from real_bench.text.naming import display_name


@dataclass(frozen=True)
class Chart:
    """A figure.

    Attributes:
        name, shows: what it is called, and shows.
        width_cm: in print.
        svg, csv: its files, as addresses that hold them.
    """

    name: str
    shows: str
    width_cm: float
    svg: str
    csv: str


@dataclass(frozen=True)
class Table:
    """A table of scores as it stands in a terminal."""

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...]
    command: str


@dataclass(frozen=True)
class Report:
    """All that a report tells.

    Attributes:
        title: of the page.
        tables: of experiments.
        plays, tests, charts: recordings, results, figures.
        remarks: what could not be shown, and why.
    """

    title: str
    tables: Sequence[Table] = ()
    plays: Sequence[RecordingEntry] = ()
    tests: Sequence[ResultEntry] = ()
    charts: Sequence[Chart] = ()
    remarks: Sequence[str] = ()


def write_report(report: Report, path: Path) -> None:
    """Write the file; it appears whole. Raises OutputError."""
    write_atomically(path, render(report).encode())


def render(report: Report) -> str:
    """The page. All text is escaped, whoever wrote it."""
    return render_html(
        packaged_text(__package__, "page.html.jinja"),
        report=report,
        display_name=display_name,
        describe_play=describe_play,
        describe_sum=describe_sum,
        style=packaged_text(__package__, "page.css"),
    )
