"""How commands print: no text can move a terminal's cursor, and no number is cut."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

from real_bench.text.quoting import printable

if TYPE_CHECKING:
    from rich.console import RenderableType

MAX_WIDTH = 10_000


class _Lines(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        say(record.getMessage(), err=True)


def log_on_stderr() -> None:
    """Print log messages on standard error, one line each."""
    logger = logging.getLogger("real_bench")
    logger.setLevel(logging.INFO)
    logger.handlers[:] = [_Lines()]


@contextmanager
def warnings_only() -> Iterator[None]:
    """Log warnings, but no remarks, such as which controller plays."""
    logger = logging.getLogger("real_bench")
    logger.setLevel(logging.WARNING)
    try:
        yield
    finally:
        logger.setLevel(logging.INFO)


def say(text: str, *, err: bool = False) -> None:
    """Print a text, even a stranger's; on standard error if ``err``."""
    click.echo(printable(text), err=err)


def print_tables(*renderables: RenderableType) -> None:
    """Print tables and lines.

    Where there is no room, the terminal breaks lines; no column is too narrow for its numbers.
    """
    from rich.console import Console, Group
    from rich.measure import Measurement
    from rich.table import Table

    console = Console(markup=False, emoji=False)
    parts = [
        part
        for renderable in renderables
        for part in getattr(renderable, "renderables", [renderable])
    ]
    free = console.options.update(max_width=MAX_WIDTH)
    needed = [
        Measurement.get(console, free, part).maximum for part in parts if isinstance(part, Table)
    ]
    console.width = max([console.width, *needed])
    console.print(Group(*parts))
