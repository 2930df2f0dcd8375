"""Where an error of somebody's controller happened, in one line."""

from __future__ import annotations

import traceback
from pathlib import Path

from real_bench.errors import RealBenchError


def blame(error: BaseException, place: Path | None = None) -> str:
    """What happened and where: the deepest line of the controller's own code.

    Args:
        error: what was raised.
        place: the folder or file of that code; without it, or where the error never went through
            it, the deepest line of all counts.
    """
    if isinstance(error, SyntaxError):
        return f"{error.filename}, line {error.lineno}: {error.msg}"
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if _is_in(frame.filename, place)] or list(frames)
    where = f"{own[-1].filename}, line {own[-1].lineno}: " if own else ""
    text = " ".join(str(error).split())
    return f"{where}{type(error).__name__}{': ' if text else ''}{text}"


def says_enough(error: BaseException, place: Path | None) -> bool:
    """Whether an error of ours needs no place: the controller raised it, or had no part in it."""
    files = [frame.filename for frame in traceback.extract_tb(error.__traceback__)]
    raised_there = bool(files) and _is_in(files[-1], place)
    had_part = any(_is_in(file, place) for file in files)
    return isinstance(error, RealBenchError) and (raised_there or not had_part)


def _is_in(file: str, place: Path | None) -> bool:
    return place is not None and Path(file).is_relative_to(place)
