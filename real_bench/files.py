"""Files that appear whole, and outputs that are never overwritten unasked."""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from filelock import FileLock, Timeout

from real_bench.errors import RealBenchError


class OutputError(RealBenchError):
    """A file that cannot be written, or must not be."""


def write_whole(path: Path, content: bytes) -> None:
    """Write a file so that it is there whole or, after any failure, as it was before."""
    path = path.resolve()  # a link stays a link
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            Path(temporary).chmod(0o644)
            Path(temporary).replace(path)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from error


def file_sha256(path: Path) -> str:
    """The hash of a file's content."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(1 << 20):
            digest.update(chunk)
    return digest.hexdigest()


@contextmanager
def write_lock(path: Path) -> Iterator[None]:
    """Be the only process that writes a file; raises OutputError where another one does.

    The lock dies with the process that holds it.
    """
    real = path.resolve()
    lock = FileLock(real.with_name(f".{real.name}.lock"), timeout=0)
    try:
        lock.acquire()
    except Timeout as error:
        raise OutputError(f"{path} is being written by another process") from error
    except OSError as error:
        raise OutputError(f"cannot write into {path.parent}: {error.strerror or error}") from error
    try:
        yield
    finally:
        Path(lock.lock_file).unlink(missing_ok=True)
        lock.release()


@contextmanager
def own_folder(prefix: str) -> Iterator[Path]:
    """A new temporary folder that does not outlive its use.

    Where a process is killed that had one, the next call with the same prefix removes it. Raises
    OutputError where there can be none.
    """
    place = Path(tempfile.gettempdir()).resolve()
    for left in place.glob(prefix + "[0-9a-f]" * 32):  # each was locked before it was made
        with suppress(OSError, OutputError):
            found = left.lstat()
            if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid():
                with write_lock(left):  # refused where it is still in use
                    _remove(left)
    folder = place / f"{prefix}{uuid4().hex}"
    with write_lock(folder):
        try:
            folder.mkdir(mode=0o700)
        except OSError as error:
            raise OutputError(f"cannot make {folder}: {error.strerror or error}") from error
        try:
            yield folder
        finally:
            _remove(folder)


def _remove(folder: Path) -> None:
    """Remove a folder, whatever a stranger has put into it; fails in silence."""
    with suppress(OSError, RecursionError):
        return shutil.rmtree(folder)
    for command in (["chmod", "-R", "u+rwx"], ["rm", "-rf"]):  # however deep, and closed
        with suppress(OSError):
            subprocess.run([*command, "--", str(folder)], capture_output=True, check=False)


def check_output(
    path: Path, *, overwrite: bool, remedy: str = "--overwrite", option: str = "--out"
) -> None:
    """Find out before any work is done whether a file can be written.

    Raises:
        OutputError: it exists and must not be overwritten, or its folder cannot be written.
    """
    if path.is_dir():
        raise OutputError(f"{path} is a folder, not a file")
    if path.exists() and not overwrite:
        raise OutputError(f"{path} exists: use {remedy}, or another {option}")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise OutputError(f"cannot write into {path.parent}: {error.strerror or error}") from error
