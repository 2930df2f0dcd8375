"""Stop cleanly when the user asks to."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from real_bench.errors import ControllerStoppedError, Interrupted

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)
SECONDS_BETWEEN_SIGNALS = 0.5
"""At most, where all processes of a job are asked to stop."""


class StopRequest:
    """Whether the user has asked to stop."""

    def __init__(self) -> None:
        self.requested = False


@contextmanager
def stop_requests() -> Iterator[StopRequest]:
    """Turn the first Ctrl-C (or SIGTERM) into a request; a second one interrupts at once.

    Outside the main thread signals cannot be handled, and no request is ever made.

    Raises:
        Interrupted: a request was made and not heeded, since the work was done before, or since an
            isolated controller was stopped, too.
    """
    request = StopRequest()
    if threading.current_thread() is not threading.main_thread():
        yield request
        return

    def on_signal(number: int, frame: FrameType | None) -> None:
        if request.requested:
            raise KeyboardInterrupt
        request.requested = True

    before = {number: signal.signal(number, on_signal) for number in STOP_SIGNALS}
    try:
        yield request
    except ControllerStoppedError as error:
        time.sleep(SECONDS_BETWEEN_SIGNALS)
        if not request.requested:
            raise
        raise Interrupted(f"stopped; what was finished is kept ({error})") from error
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if request.requested:
        raise Interrupted("stopped at the end of the work")
