"""What a stranger's file says, fit for a line of ours."""

from __future__ import annotations

LONGEST = 80


def quoted(text: str) -> str:
    """A text in one short line, without what a terminal might obey."""
    line = "".join(letter if letter.isprintable() else "?" for letter in text)
    return line if len(line) <= LONGEST else line[: LONGEST - 3] + "..."
