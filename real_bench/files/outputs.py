"""Outputs are checked before any work."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from uuid import uuid4

from real_bench.files.atomic import (
    OutputError,
    as_output_error,
    real_path,
    status_of_file,
)
from real_bench.files.kinds import FileKind, first_bytes

MOUNTS = Path("/proc/self/mountinfo")


def check_output(
    path: Path,
    *,
    overwrite: bool,
    kind: FileKind | None = None,
    remedy: str = "--overwrite",
    instead: str = "another --out",
) -> None:
    """Check before any work that a file can be written.

    Args:
        path: the file.
        overwrite: it may replace one that exists.
        kind: of the file; one of another kind is never replaced, unless it is empty.
        remedy: what lets it replace one, for the message.
        instead: what else to do, for the message.

    Raises:
        OutputError: it exists and must not be overwritten, cannot be replaced, or is not a file.
    """
    with as_output_error(f"cannot write {path}"):
        status = status_of_file(path)
        if status is not None:
            if not overwrite:
                raise OutputError(f"{path} exists: use {remedy}, or {instead}")
            _check_replaceable(path, status)
            if kind is not None and not is_of_kind(path, kind):
                raise OutputError(
                    f"{path} is no {kind.name}, so it is not overwritten: use {instead}"
                )
        parent = real_path(path).parent if path.is_symlink() else path.parent
    check_folder(parent)


def is_of_kind(path: Path, kind: FileKind) -> bool:
    """Whether a file is, by its first bytes, or is empty."""
    first = first_bytes(path)
    return not first or kind.begins(first)


def check_folder(folder: Path, *, make: bool = False) -> None:
    """Check before any work that files can be written into a folder.

    Args:
        folder: the folder.
        make: create it if it does not exist.

    Raises:
        OutputError: they cannot.
    """
    with as_output_error(f"cannot write into {folder}"):
        if make:
            folder.mkdir(parents=True, exist_ok=True)
        tried = real_path(folder) / f".{uuid4().hex[:12]}"
        tried.touch(exist_ok=False)
        tried.unlink()


def _check_replaceable(path: Path, status: os.stat_result) -> None:
    check_writable(path, status)
    if (handle := own_stream(status)) is not None:
        os.close(handle)
        raise OutputError(f"{path} is where this command prints to: use another file")
    if _is_mounted(real_path(path)):
        raise OutputError(
            f"{path} is mounted by itself and cannot be replaced: mount its folder instead"
        )


def check_writable(path: Path, status: os.stat_result) -> None:
    """Refuse a protected file, even if root could write it."""
    if not status.st_mode & 0o222 or not os.access(path, os.W_OK):
        raise OutputError(f"{path} is read-only: make it writable (chmod u+w), or use another file")


def own_stream(status: os.stat_result | None) -> int | None:
    """A second handle of our own standard output or error, if that is the file.

    If it were opened by name it would be overwritten, since each handle has its own position.
    """
    for handle in (1, 2):
        with suppress(OSError):
            if status is not None and os.path.samestat(status, os.fstat(handle)):
                return os.dup(handle)
    return None


def _is_mounted(file: Path) -> bool:
    """Whether a file is a mount point of its own, as a container may have it."""
    try:
        lines = MOUNTS.read_bytes().splitlines()
    except OSError:  # another system
        return False
    escaped = os.fsencode(file)
    for letter in (b"\\", b" ", b"\t", b"\n"):
        escaped = escaped.replace(letter, b"\\%03o" % ord(letter))
    return any(line.split(b" ")[4] == escaped for line in lines)
