"""The names of signals."""

from __future__ import annotations

import signal


def signal_name(number: int) -> str:
    """The name of a signal; a real-time signal has none but its number."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
