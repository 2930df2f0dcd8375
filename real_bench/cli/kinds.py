"""Which kind of benchmark file a file is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from real_bench.files import kinds

_KINDS = (kinds.RECORDING, kinds.GOAL_SET, kinds.RESULT)

RECORDING, GOAL_SET, RESULT = (kind.name for kind in _KINDS)
EXPERIMENT = "experiment"

_EXPERIMENT_SUFFIX = ".yaml"


def kind_of(file: Path) -> str:
    """The kind of a file, by its first bytes or else by its suffix; .yaml is an experiment.

    Raises:
        click.UsageError: it is none of them, or does not exist.
    """
    first = b""
    if file.is_file():
        first = kinds.first_bytes(file)
        if file.suffix == _EXPERIMENT_SUFFIX:  # may be written as JSON, as a result is
            return EXPERIMENT
    for kind in _KINDS:
        if first.startswith(kind.magic):  # JSON of something else gets a message of its own
            return kind.name
    suffixes = {_EXPERIMENT_SUFFIX: EXPERIMENT, **{kind.suffix: kind.name for kind in _KINDS}}
    if file.suffix in suffixes:
        return suffixes[file.suffix]
    if not file.exists():
        raise click.UsageError(f"file not found: {file}")
    names = ", ".join((RECORDING, GOAL_SET, RESULT, EXPERIMENT))
    raise click.UsageError(f"{file} is none of: {names}")


def by_kind(files: Sequence[Path], *wanted: str) -> dict[str, list[Path]]:
    """Files by kind, each once; raises click.UsageError for an unwanted kind."""
    found: dict[str, list[Path]] = {kind: [] for kind in wanted}
    for file in {file.resolve(): file for file in files}.values():
        kind = kind_of(file)
        if kind not in found:
            raise click.UsageError(f"{file}: {' or '.join(wanted)} expected, not {kind}")
        found[kind].append(file)
    return found
