"""Put a report's parts into one HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from real_bench.files import write_atomically
from real_bench.naming import display_name
from real_bench.quoting import printable
from real_bench.report.parts import RecordingEntry, ResultEntry
from real_bench.version import __version__


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
    from jinja2 import Environment, StrictUndefined

    here = files("real_bench.report")
    page = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        finalize=lambda value: printable(value) if type(value) is str else value,
    ).from_string((here / "page.html.jinja").read_text(encoding="utf-8"))
    return page.render(
        report=report,
        display_name=display_name,
        style=(here / "page.css").read_text(encoding="utf-8"),
        script=(here / "page.js").read_text(encoding="utf-8"),
        version=__version__,
    )
