"""Which of our files a file is."""

from __future__ import annotations

from pathlib import Path

import click

RECORDING, GOAL_SET, RESULT = "recording", "goal set", "result"

_SIGNS = {
    RECORDING: (".h5", b"\x89HDF"),
    GOAL_SET: (".npy", b"\x93NUMPY"),
    RESULT: (".json", b"{"),
}


def kind_of(file: Path) -> str:
    """What a file is by its first bytes, or by its name where these say nothing.

    Raises:
        click.UsageError: neither says anything.
    """
    first = b""
    if file.is_file():
        with file.open("rb") as opened:
            first = opened.read(8)
    for kind, (_, magic) in _SIGNS.items():
        if first.startswith(magic):
            return kind
    for kind, (suffix, _) in _SIGNS.items():
        if file.suffix == suffix:
            return kind
    raise click.UsageError(f"{file} is no recording, goal set or result")
