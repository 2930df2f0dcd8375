"""Progress of long work, on stderr: a live bar for a person, a line now and then for a log."""

from __future__ import annotations

import logging
import time

from rich.console import Console
from rich.logging import RichHandler
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Column

from real_bench.quoting import printable

SECONDS_BETWEEN_LINES = 30.0
LEAST_WIDTH = 72
"""Of a terminal in which a bar has room for its numbers; a narrower one gets lines."""


def _cut(*, max_width: int | None = None, ratio: int | None = None) -> Column:
    """A column whose text is cut where there is no room, so that numbers keep theirs."""
    return Column(no_wrap=True, overflow="ellipsis", max_width=max_width, ratio=ratio)


class ProgressDisplay:
    """How far a piece of work has come; use it as a context manager.

    Args:
        title: what is done.
        unit: of what ``total`` counts.
        total: how much there is to do.
    """

    def __init__(self, title: str, unit: str, total: int) -> None:
        self._title, self._unit, self._total = printable(title), unit, total
        self._console = Console(stderr=True, markup=False, emoji=False)
        self._live = self._console.is_terminal and self._console.width >= LEAST_WIDTH
        self._console.width = max(self._console.width, LEAST_WIDTH)
        self._bar = Progress(
            TextColumn("{task.description}", markup=False, table_column=_cut(max_width=24)),
            BarColumn(bar_width=10),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(elapsed_when_finished=False),
            # the room that is left
            TextColumn("{task.fields[note]}", markup=False, table_column=_cut(ratio=1)),
            console=self._console,
            expand=True,
            disable=not self._live,
            transient=True,
        )
        self._task = self._bar.add_task(self._title, total=total, note="")
        self._handler = RichHandler(
            console=self._console, show_time=False, show_level=False, show_path=False
        )
        self._others: list[logging.Handler] = []
        self._began = self._last_line = time.monotonic()
        self._first: int | None = None

    def update(self, done: int, note: str = "") -> None:
        """So much is done; ``note`` is shown beside it."""
        note = printable(note)
        if self._first is None:
            self._first = done
            self._began = time.monotonic()
            self._bar.update(self._task, completed=done)
        self._bar.update(self._task, completed=done, note=note)
        now = time.monotonic()
        if not self._live and now - self._last_line > SECONDS_BETWEEN_LINES:
            self._last_line = now
            self._console.print(self._line(done, note), soft_wrap=True, highlight=False)

    def _line(self, done: int, note: str) -> str:
        parts = [f"{self._title}: {done:,} of {self._total:,} {self._unit}", note]
        if self.rate(done) > 0:  # the first report only says where it begins
            parts.append(f"about {(self._total - done) / self.rate(done):,.0f} s left")
        return ", ".join(filter(None, parts))

    def rate(self, done: int) -> float:
        """How much is done a second, in this process."""
        return (done - (self._first or 0)) / max(time.monotonic() - self._began, 1e-9)

    def __enter__(self) -> ProgressDisplay:
        self._bar.start()
        if self._live:  # what parts say of their work goes above the bar
            handlers = logging.getLogger("real_bench").handlers
            self._others, handlers[:] = list(handlers), [self._handler]
        return self

    def __exit__(self, *_: object) -> None:
        if self._live:
            logging.getLogger("real_bench").handlers[:] = self._others
        self._bar.stop()
