"""Where an error in a controller happened, in one line."""

from __future__ import annotations

import traceback
from pathlib import Path

from real_bench.errors import RealBenchError
from real_bench.text.quoting import one_line

OURS = Path(__file__).parents[1]


def blame(error: BaseException, place: Path | None = None) -> str:
    """What happened and where: the deepest line of the controller's own code.

    If that line called a helper elsewhere, the helper's line is added.

    Args:
        error: what was raised.
        place: the folder or file of that code; without it, or if the error never went through
            it, the deepest line of all counts.
    """
    if isinstance(error, SyntaxError):
        return f"{error.filename}, line {error.lineno}: {error.msg}"
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if _is_in(frame.filename, place)]
    if not own and not (place and all(_is_in(frame.filename, OURS) for frame in frames)):
        own = list(frames)  # otherwise it could not even be called
    where = f"{_line(own[-1])}: " if own else f"{place}: " if place else ""
    text = one_line(error)
    sentence = f"{where}{type(error).__name__}{': ' if text else ''}{text}"
    if own and frames[-1] is not own[-1] and not _is_in(frames[-1].filename, OURS):
        return f"{sentence} (raised at {_line(frames[-1])})"
    return sentence


def is_self_explanatory(error: BaseException, place: Path | None) -> bool:
    """Whether an error of ours needs no place: the controller raised it, or was not involved."""
    files = [frame.filename for frame in traceback.extract_tb(error.__traceback__)]
    raised_by_controller = bool(files) and _is_in(files[-1], place)
    is_involved = any(_is_in(file, place) for file in files)
    return isinstance(error, RealBenchError) and (raised_by_controller or not is_involved)


def _line(frame: traceback.FrameSummary) -> str:
    return f"{frame.filename}, line {frame.lineno}"


def _is_in(file: str, place: Path | None) -> bool:
    return place is not None and Path(file).is_relative_to(place)
