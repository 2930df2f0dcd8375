"""Names of controllers and scenes."""

from __future__ import annotations

import re
from pathlib import Path

CONTROLLER_FILE = re.compile(r"(?P<file>.*\.py)(:(?P<name>[^:/\\]*))?")
"""A controller in a file: ``path/to/file.py[:Class]``. Folders may have colons."""

_EXPLORE_AT_RANDOM = frozenset({"real_r", "real_t", "real_d", "real_ld"})


def display_name(spec: str) -> str:
    """A controller's name as the paper writes it; for a file its class, or the file's name."""
    if found := CONTROLLER_FILE.fullmatch(spec):
        return found["name"] or Path(found["file"]).stem
    module, _, class_name = spec.rpartition(":")
    if module:
        return class_name
    return spec.upper().replace("_", "-") if spec.startswith("real_") else spec


def shareable_name(spec: str) -> str:
    """A controller's name as stored in files for others: without folders."""
    file, name = without_folder(spec)
    return f"{file}:{name}" if name else file


def scene_name(source: str) -> str:
    """A scene's name for others: for a manifest without the folder in which it is."""
    return Path(source).stem if source.endswith((".yaml", ".yml")) else source


def explores_at_random(spec: str) -> bool:
    """Whether it is one of the paper's controllers that play at random: they can share a play."""
    return spec in _EXPLORE_AT_RANDOM


def without_folder(spec: str) -> tuple[str, str]:
    """A controller's file or name, and its class; for names from another machine."""
    if found := CONTROLLER_FILE.fullmatch(spec):
        return Path(found["file"]).name, found["name"] or ""
    place, colon, name = spec.rpartition(":")
    return (Path(place).name, name) if colon else (spec, "")


def trial_name(goal: int) -> str:
    """What the files of a trial are called, without suffix."""
    return f"trial-{goal:02d}"
