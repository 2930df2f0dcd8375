"""The standard streams, as they may be: closed, full, or of few letters."""

from __future__ import annotations

import io
import os
import sys
from contextlib import suppress

import click

from real_bench.quoting import printable

STANDARD = {0: ("stdin", "r"), 1: ("stdout", "w"), 2: ("stderr", "w")}


def make_usable() -> None:
    """Open those that are closed to nowhere, and have letters that a terminal lacks written out.

    Else the next file that is opened would take the place of a closed one.
    """
    for handle, (name, mode) in STANDARD.items():
        try:
            os.fstat(handle)
        except OSError:
            nowhere = os.open(os.devnull, os.O_RDWR)  # the lowest that is free: this one
            if nowhere != handle:
                os.dup2(nowhere, handle)
                os.close(nowhere)
        if getattr(sys, name) is None:
            setattr(sys, name, open(handle, mode, closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def flush() -> None:
    """Have all that was printed arrive; raises OSError where it cannot."""
    for stream in (sys.stdout, sys.stderr):
        stream.flush()


def end(line: str, code: int) -> None:
    """Say one last line on standard error, where that can be, and exit."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError):
        _to_nowhere(1)
    try:
        click.echo(f"realbench: {printable(' '.join(line.split()))}", err=True)
    except (OSError, ValueError):
        _to_nowhere(2)
    sys.exit(code)


def _to_nowhere(handle: int) -> None:
    """Let Python not complain again of what it could not print, when it ends."""
    with suppress(OSError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, handle)
        os.close(nowhere)
