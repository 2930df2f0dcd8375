"""Numbers of a controller's own, on their way into the recording (``Controller.log``)."""

from __future__ import annotations

from typing import Any, SupportsFloat

MAX_NAME_LENGTH = 64
"""Bytes of a name in UTF-8."""

MAX_ENTRIES = 10_000
"""The most entries kept per action; if there are more, the last are kept."""

MAX_ENTRIES_OF_STRANGERS = 100_000_000
"""The most that an isolated controller may log in one play: a few at each step, and some GB."""

Entry = tuple[str, float]
"""Name and value."""

_ATTRIBUTE = "_realbench_logbook"


def checked_entry(name: object, value: SupportsFloat) -> Entry:
    """Name and value, if they can be recorded; a value may be infinite or NaN.

    Raises:
        TypeError, ValueError: they cannot.
    """
    if not isinstance(name, str):
        raise TypeError(f"a name must be text, not {type(name).__name__}")
    if not name.isprintable() or not 1 <= len(name.encode()) <= MAX_NAME_LENGTH:
        raise ValueError(
            f"a name must be 1 to {MAX_NAME_LENGTH} printable bytes, not {name[:80]!r}"
        )
    detach = getattr(value, "detach", None)  # a tensor warns when it becomes a number
    return name, float(detach() if callable(detach) else value)


def add_entry(controller: object, name: str, value: SupportsFloat) -> None:
    """Keep a number in a controller until the harness takes it; raises as checked_entry does."""
    entry = checked_entry(name, value)
    # Plain data, so that a controller whose state is all of its attributes can still be kept.
    entries_so_far = vars(controller).setdefault(_ATTRIBUTE, [])
    entries_so_far.append(entry)
    del entries_so_far[:-MAX_ENTRIES]


def take_entries(controller: Any) -> list[Entry]:
    """What a controller logged since the last call, in order."""
    entries_so_far = getattr(controller, "__dict__", {}).get(_ATTRIBUTE)
    if not entries_so_far:
        return []
    entries = list(entries_so_far)
    entries_so_far.clear()
    return entries
