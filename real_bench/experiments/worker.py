"""Do one job in this process; see ``process.py``, which starts it.

The job comes as one line of JSON on standard input, which then stays open: when it closes, whoever
asked is gone, and so is this process. Lines of JSON on standard output say how far it has come
(``done``, in steps) and how it ended (``finished`` or ``failed``).
"""

from __future__ import annotations

import json
import logging
import os
import sys
import threading
import time
from typing import Any, TextIO

from real_bench.errors import RealBenchError
from real_bench.experiments.jobs import job_from_json

SECONDS_BETWEEN_REPORTS = 0.2


class _Channel:
    """Where the lines go."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._last = 0.0

    def tell(self, **message: Any) -> None:
        """One line."""
        self._stream.write(json.dumps(message) + "\n")
        self._stream.flush()

    def report(self, done: int) -> None:
        """How many steps are done, but not too often."""
        now = time.monotonic()
        if now - self._last > SECONDS_BETWEEN_REPORTS:
            self._last = now
            self.tell(done=done)


def main() -> None:
    """Do what standard input asks for."""
    channel = _Channel(os.fdopen(os.dup(1), "w"))
    os.dup2(2, 1)  # what a controller prints is no message
    logging.basicConfig(format="%(message)s")
    logging.getLogger("real_bench").setLevel(logging.INFO)
    job = job_from_json(sys.stdin.readline())
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        job.do(channel.report)
    except RealBenchError as error:
        channel.tell(failed=str(error), kind=type(error).__name__)
    else:
        channel.tell(finished=True)


def _end_with_parent() -> None:
    sys.stdin.read()
    os._exit(1)
