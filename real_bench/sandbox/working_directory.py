"""The working directory of an isolated controller: a copy of its folder."""

import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path, PurePosixPath

from real_bench.controller_code.source import is_ignored

BEGINNING = ".realbench-beginning"
"""The file that says what was there at the start: names and hashes."""


def make(place: Path, folder: Path | None, own: Iterable[Path], hidden: Iterable[Path]) -> None:
    """Make the working directory, and go there.

    Args:
        place: where to make it.
        folder: the controller's folder; None if there is none to copy.
        own: what of that folder is copied.
        hidden: what is left out of these.
    """
    place.mkdir()
    os.chdir(place)
    if folder is not None:
        left_out = set(hidden)
        for path in own:
            _copy(path, place / path.relative_to(folder), left_out)
    Path(BEGINNING).write_text(json.dumps({name: _sha256(path) for name, path in _files().items()}))


def new_files() -> dict[str, bytes]:
    """What is new or changed in the working directory since it was made, by name."""
    before = json.loads(Path(BEGINNING).read_text())
    return {
        name: path.read_bytes()
        for name, path in _files().items()
        if before.get(name) != _sha256(path)
    }


def put_files(files: Mapping[str, bytes]) -> None:
    """Write files into the working directory."""
    for name, content in files.items():
        path = Path(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def is_plain_path(name: str) -> bool:
    """Whether a name stays below the folder in which it is used."""
    path = PurePosixPath(name)
    return (
        name.isprintable()
        and bool(path.parts)
        and not path.is_absolute()
        and ".." not in path.parts
        and "\\" not in name
    )


def _copy(path: Path, to: Path, left_out: set[Path]) -> None:
    if path in left_out or is_ignored(path):
        return
    if path.is_dir():
        to.mkdir(exist_ok=True)
        for part in path.iterdir():
            _copy(part, to / part.name, left_out)
    elif path.is_file():
        shutil.copyfile(path, to)


def _files() -> dict[str, Path]:
    found = (Path(folder) / name for folder, _, names in os.walk(".") for name in names)
    return {
        path.as_posix(): path
        for path in sorted(found)
        if path.is_file()
        and not path.is_symlink()
        and not _is_cache(path)
        and path.name != BEGINNING
    }


def _is_cache(path: Path) -> bool:
    return "__pycache__" in path.parts


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
