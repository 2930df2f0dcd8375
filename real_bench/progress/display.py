"""Progress of long work, on stderr: a live bar in a terminal, a line now and then in a log."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.logging import RichHandler
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Column
from rich.text import Text

from real_bench.text.quoting import printable

SECONDS_BETWEEN_LINES = 30.0
ACTIVITY_DELAY_S = 1.0
"""Shorter activities of a controller are not shown."""
MIN_WIDTH = 72
"""Width of a terminal in which a bar has room for its numbers; a narrower one gets lines."""


def _truncating_column(*, max_width: int | None = None, ratio: int | None = None) -> Column:
    """A column whose text is cut if there is no room, so that numbers keep theirs."""
    return Column(no_wrap=True, overflow="ellipsis", max_width=max_width, ratio=ratio)


class _NoteColumn(ProgressColumn):
    """The text beside the numbers, read whenever the bar is drawn."""

    max_refresh = None

    def __init__(self, display: ProgressDisplay) -> None:
        super().__init__(_truncating_column(ratio=1))  # the room that is left
        self._display = display

    def render(self, task: Task) -> Text:
        return Text(self._display.note)


class ProgressDisplay:
    """The progress of a piece of work; use it as a context manager.

    Args:
        title: what is being done.
        unit: what ``total`` counts.
        total: how much there is to do.
        shown: whether to show anything.
    """

    def __init__(self, title: str, unit: str, total: int, *, shown: bool = True) -> None:
        self._title, self._unit, self._total = printable(title), unit, total
        self._console = Console(stderr=True, markup=False, emoji=False)
        self._shown = shown
        self._live = self._shown and self._console.is_terminal and self._console.width >= MIN_WIDTH
        self._console.width = max(self._console.width, MIN_WIDTH)
        self._bar = Progress(
            TextColumn(
                "{task.description}", markup=False, table_column=_truncating_column(max_width=24)
            ),
            BarColumn(bar_width=10),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(elapsed_when_finished=False),
            _NoteColumn(self),
            console=self._console,
            expand=True,
            disable=not self._live,
            transient=True,
        )
        self._task = self._bar.add_task(self._title, total=total)
        self._handler = RichHandler(
            console=self._console, show_time=False, show_level=False, show_path=False
        )
        self._others: list[logging.Handler] = []
        self._began = self._last_line = time.monotonic()
        self._first: int | None = None
        self._done, self._note = 0, ""
        self._activity: tuple[str, float] | None = None
        self._ended = threading.Event()

    @property
    def note(self) -> str:
        """The text beside the numbers: a long activity, or the last note."""
        return self._busy_with() or self._note

    @contextmanager
    def activity(self, what: str) -> Iterator[None]:
        """Show what the controller is busy with, as long as the context lasts."""
        self._activity = (printable(what), time.monotonic())
        try:
            yield
        finally:
            self._activity = None

    def update(self, done: int, note: str = "") -> None:
        """Show how much is done, and ``note`` beside it."""
        self._done, self._note = done, printable(note)
        if self._first is None:
            self._first = done
            self._began = time.monotonic()
        self._bar.update(self._task, completed=done)
        self._print_occasionally()

    def _print_occasionally(self) -> None:
        """Print a line in a log that has had none for a while."""
        now = time.monotonic()
        if self._shown and not self._live and now - self._last_line > SECONDS_BETWEEN_LINES:
            self._last_line = now
            self._console.print(self._line(), soft_wrap=True, highlight=False)

    def _print_while_busy(self) -> None:
        while not self._ended.wait(ACTIVITY_DELAY_S):
            if self._busy_with():
                self._print_occasionally()

    def _busy_with(self) -> str:
        activity = self._activity  # another thread may end it
        if activity is None:
            return ""
        seconds = int(time.monotonic() - activity[1])
        return f"{activity[0]}, {_clock(seconds)}" if seconds >= ACTIVITY_DELAY_S else ""

    def _line(self) -> str:
        done = self._done
        parts = [f"{self._title}: {done:,} of {self._total:,} {self._unit}", self.note]
        # the first report only says where work begins
        if self.rate(done) > 0 and not self._busy_with():
            parts.append(f"about {(self._total - done) / self.rate(done):,.0f} s left")
        return ", ".join(filter(None, parts))

    def rate(self, done: int) -> float:
        """How much is done per second, in this process."""
        return (done - (self._first or 0)) / max(time.monotonic() - self._began, 1e-9)

    def __enter__(self) -> ProgressDisplay:
        self._bar.start()
        if self._shown and not self._live:
            threading.Thread(target=self._print_while_busy, daemon=True).start()
        if self._live:  # log messages go above the bar
            handlers = logging.getLogger("real_bench").handlers
            self._others, handlers[:] = list(handlers), [self._handler]
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        if self._live:
            logging.getLogger("real_bench").handlers[:] = self._others
        self._bar.stop()


def _clock(seconds: int) -> str:
    minutes, rest = divmod(seconds, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
