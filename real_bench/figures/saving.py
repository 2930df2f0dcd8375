"""Write figures into a folder: a picture, a vector drawing and the numbers of each."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from real_bench.figures.drawing import Drawing
from real_bench.figures.registry import FIGURES
from real_bench.files.atomic import write_atomically
from real_bench.files.outputs import check_folder, check_output

SUFFIXES = (".png", ".svg", ".csv")
SUMMARY = "figures.json"


def prepare_folder(folder: Path, *, overwrite: bool) -> None:
    """Make the folder, and check before any work that it can be written.

    Raises:
        OutputError: it holds figures that must not be overwritten, or cannot be written.
    """
    check_folder(folder, make=True)
    for path in (
        folder / SUMMARY,
        *(path for kind in FIGURES for path in paths(folder, kind.name)),
    ):
        check_output(path, overwrite=overwrite)


def paths(folder: Path, name: str) -> list[Path]:
    """The files of one figure."""
    return [folder / f"{name}{suffix}" for suffix in SUFFIXES]


def save_drawing(folder: Path, name: str, drawing: Drawing) -> None:
    """Write a figure's files; each appears whole."""
    contents = (drawing.png(), drawing.svg(), drawing.numbers.csv())
    for path, content in zip(paths(folder, name), contents, strict=True):
        write_atomically(path, content)


def drawn_before(folder: Path) -> set[str]:
    """The names of the figures in a folder, as its summary tells."""
    try:
        return set(json.loads((folder / SUMMARY).read_bytes())["drawn"])
    except (OSError, ValueError, LookupError, TypeError):
        return set()


def remove_drawing(folder: Path, name: str) -> None:
    """Remove an earlier version of a figure that is not drawn now."""
    for path in paths(folder, name):
        path.unlink(missing_ok=True)


def save_summary(folder: Path, facts: Mapping[str, Any]) -> None:
    """Write what the figures are of, and their single numbers."""
    text = json.dumps(facts, indent=1, allow_nan=False)
    write_atomically(folder / SUMMARY, (text + "\n").encode())
