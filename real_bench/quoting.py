"""What a stranger's file says, fit for a line of ours."""

from __future__ import annotations

LONGEST = 80


def quoted(text: str, longest: int = LONGEST) -> str:
    """A text in one short line, without what a terminal might obey."""
    short = text if len(text) <= longest else text[: longest - 3] + "..."
    return "".join(letter if letter.isprintable() else "?" for letter in short)
