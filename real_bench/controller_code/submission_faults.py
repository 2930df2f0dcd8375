"""Whatever a stranger's files make go wrong, as one kind of error: it is the submission's fault."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from real_bench.errors import RealBenchError, SubmissionError

OUR_TROUBLE = frozenset(
    {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EMFILE, errno.ENFILE, errno.ENOMEM}
)
"""What only this machine can be blamed for: no room, or no more open files."""


@contextmanager
def as_submission_error(what: str) -> Iterator[None]:
    """Turn any error into SubmissionError, unless it is one of ours, or this machine's fault.

    Libraries that read archives, text and paths promise no error in particular for bad ones.

    Args:
        what: what cannot be done, for the message.
    """
    try:
        yield
    except RealBenchError:
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.errno in OUR_TROUBLE:
            raise
        raise SubmissionError(f"{what}: {_reason(error)}") from error


def _reason(error: Exception) -> str:
    if isinstance(error, RecursionError):
        return "too many folders within each other"
    if isinstance(error, UnicodeError):
        return "a name in it is not UTF-8"
    if isinstance(error, OSError) and error.strerror:
        place = Path(str(error.filename)).name if error.filename else ""
        return f"{error.strerror}{f' ({place})' if place else ''}"
    return str(error) or type(error).__name__
