"""The standard streams, which may be closed, full, or unable to show some characters."""

from __future__ import annotations

import io
import os
import sys
from contextlib import suppress

import click

from real_bench.text.quoting import printable

STANDARD = {0: ("stdin", "r"), 1: ("stdout", "w"), 2: ("stderr", "w")}


def make_usable() -> None:
    """Open closed streams to nowhere, and escape characters that a terminal cannot show.

    Otherwise the next file to be opened would take the place of a closed stream.
    """
    for handle, (name, mode) in STANDARD.items():
        try:
            os.fstat(handle)
        except OSError:
            devnull = os.open(os.devnull, os.O_RDWR)  # takes the lowest free handle: this one
            if devnull != handle:
                os.dup2(devnull, handle)
                os.close(devnull)
        if getattr(sys, name) is None:
            setattr(sys, name, open(handle, mode, closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def flush() -> None:
    """Write out everything printed so far; raises OSError if that fails."""
    for stream in (sys.stdout, sys.stderr):
        stream.flush()


def end(line: str, code: int) -> None:
    """Print one last line on standard error, if possible, and exit."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError):
        _redirect_to_devnull(1)
    try:
        click.echo(f"realbench: {printable(' '.join(line.split()))}", err=True)
    except (OSError, ValueError):
        _redirect_to_devnull(2)
    sys.exit(code)


def _redirect_to_devnull(handle: int) -> None:
    """Keep Python from complaining again, at exit, about what it could not print."""
    with suppress(OSError):
        devnull = os.open(os.devnull, os.O_WRONLY)
        os.dup2(devnull, handle)
        os.close(devnull)
