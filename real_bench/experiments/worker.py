"""Do one job in this process; see ``process.py``, which starts it.

The job comes as one line of JSON on standard input, which then stays open: when it closes, the
parent is gone, and this process ends. Lines of JSON on standard output report the progress
(``done``, in steps, and what its controller is ``busy`` with) and the end (``finished`` or
``failed``, with the class of the error).
"""

from __future__ import annotations

import json
import logging
import os
import sys
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from real_bench.controller_code.blame import blame
from real_bench.errors import Interrupted, RealBenchError
from real_bench.experiments.jobs import job_from_json
from real_bench.parent import exit_after
from real_bench.text.quoting import quoted

SECONDS_BETWEEN_REPORTS = 0.2
ACTIVITY_DELAY_S = 1.0
"""Shorter activities of a controller are not reported."""


class _Channel:
    """Where the lines go."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._last = 0.0
        self._done = 0
        self._activity: tuple[str, float] | None = None
        self._lock, self._ended = threading.Lock(), False

    def send(self, **message: Any) -> None:
        """Write a line; none after the one that reports the end."""
        with self._lock:
            if not self._ended:
                self._stream.write(json.dumps(message) + "\n")
                self._stream.flush()
            self._ended = self._ended or "done" not in message

    def report(self, done: int, busy: str = "") -> None:
        """Report how many steps are done, but not too often."""
        self._done, now = done, time.monotonic()
        if now - self._last > SECONDS_BETWEEN_REPORTS:
            self._last = now
            self.send(done=done, busy=busy)

    @contextmanager
    def activity(self, what: str) -> Iterator[None]:
        """Report what the controller is busy with, as long as the context lasts."""
        self._activity = (what, time.monotonic())
        try:
            yield
        finally:
            self._activity = None

    def report_while_busy(self) -> None:
        """Report what the controller is busy with, while it is; never returns."""
        while True:
            time.sleep(ACTIVITY_DELAY_S)
            activity = self._activity
            if activity and time.monotonic() - activity[1] > ACTIVITY_DELAY_S:
                self.send(done=self._done, busy=activity[0])


def main() -> None:
    """Do the job that comes on standard input."""
    channel = _Channel(os.fdopen(os.dup(1), "w"))
    os.dup2(2, 1)  # a controller's prints are not messages
    logging.basicConfig(format="%(message)s")
    logging.getLogger("real_bench").setLevel(logging.INFO)
    job = job_from_json(sys.stdin.readline())
    exit_after(sys.stdin.read)
    threading.Thread(target=channel.report_while_busy, daemon=True).start()
    try:
        job.do(channel.report, channel.activity)
    except (Exception, Interrupted) as error:
        traceback.print_exc()  # into the job's log
        foreseen = isinstance(error, RealBenchError | Interrupted)
        told = str(error) if foreseen else quoted(blame(error), 1000)
        channel.send(failed=told, kind=type(error).__name__)
    else:
        channel.send(finished=True)
