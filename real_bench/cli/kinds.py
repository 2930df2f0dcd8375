"""Which kind of benchmark file a file is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

RECORDING, GOAL_SET, RESULT, EXPERIMENT = "recording", "goal set", "result", "experiment"

_SIGNS: dict[str, tuple[str, bytes | None]] = {
    RECORDING: (".h5", b"\x89HDF"),
    GOAL_SET: (".npy", b"\x93NUMPY"),
    RESULT: (".json", b"{"),
    EXPERIMENT: (".yaml", None),
}


def kind_of(file: Path) -> str:
    """The kind of a file, by its first bytes or else by its suffix; .yaml is an experiment.

    Raises:
        click.UsageError: it is none of them, or does not exist.
    """
    first = b""
    if file.is_file():
        with file.open("rb") as opened:
            first = opened.read(8)
        if file.suffix == _SIGNS[EXPERIMENT][0]:  # may be written as JSON, as a result is
            return EXPERIMENT
    for kind, (_, magic) in _SIGNS.items():
        if magic is not None and first.startswith(magic):
            return kind
    for kind, (suffix, _) in _SIGNS.items():
        if file.suffix == suffix:
            return kind
    if not file.exists():
        raise click.UsageError(f"file not found: {file}")
    raise click.UsageError(f"{file} is none of: {', '.join(_SIGNS)}")


def by_kind(files: Sequence[Path], *wanted: str) -> dict[str, list[Path]]:
    """Files by kind, each once; raises click.UsageError for an unwanted kind."""
    found: dict[str, list[Path]] = {kind: [] for kind in wanted}
    for file in {file.resolve(): file for file in files}.values():
        kind = kind_of(file)
        if kind not in found:
            raise click.UsageError(f"{file}: {' or '.join(wanted)} expected, not {kind}")
        found[kind].append(file)
    return found
