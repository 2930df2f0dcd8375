"""Files that appear whole."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4

from real_bench.errors import RealBenchError

KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
}


class OutputError(RealBenchError):
    """A file that cannot be written, or must not be."""


def write_atomically(path: Path, content: bytes, *, is_secret: bool = False) -> None:
    """Write a file so that it is either complete or, after any failure, unchanged.

    Args:
        path: the file.
        content: all of it.
        is_secret: let nobody else read it, at any moment.
    """
    with atomic_replacement(path, is_secret=is_secret) as hidden, hidden.open("wb") as file:
        file.write(content)


@contextmanager
def atomic_replacement(path: Path, *, is_secret: bool = False) -> Iterator[Path]:
    """An empty hidden file that replaces a file once it is written.

    After any failure the file is unchanged. It keeps its mode (a new one follows the umask) unless
    it is secret, when only its owner may read it; hard links to it keep the old content. A symbolic
    link to a file stays a link.

    Raises:
        OutputError: it cannot be written, or exists and is not a file.
    """
    with as_output_error(f"cannot write {path}"):
        status = status_of_file(path)
        real = real_path(path)
        hidden = real.with_name(f".{uuid4().hex[:12]}{real.suffix}")
        mode = 0o600 if status or is_secret else 0o666
        os.close(os.open(hidden, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode))
    try:
        with as_output_error(f"cannot write {path}"):
            if status is not None and not is_secret:
                hidden.chmod(stat.S_IMODE(status.st_mode))
        try:
            yield hidden
        except OSError as error:
            if error.filename in (None, str(hidden)):  # else something else failed
                raise OutputError(f"cannot write {path}: {error.strerror or error}") from error
            raise
        with as_output_error(f"cannot write {path}"):
            with hidden.open("rb") as written:
                os.fsync(written.fileno())
            hidden.replace(real)
    except BaseException:
        hidden.unlink(missing_ok=True)
        raise


def real_path(path: Path) -> Path:
    """Where a file is, all links followed; a circular link is reported when it is opened."""
    return Path(os.path.realpath(path))


def status_of(path: Path) -> os.stat_result | None:
    """The status of a path, links followed; None if nothing is there."""
    try:
        return path.stat()
    except FileNotFoundError:
        return None


def status_of_file(path: Path) -> os.stat_result | None:
    """The same; raises OutputError for what is there and is not a file."""
    status = status_of(path)
    if status is not None and not stat.S_ISREG(status.st_mode):
        kind = KINDS.get(stat.S_IFMT(status.st_mode), "no file")
        raise OutputError(f"{path} is {kind}, not a file")
    return status


@contextmanager
def as_output_error(what: str) -> Iterator[None]:
    """Turn the system's errors into ours."""
    try:
        yield
    except (OSError, ValueError) as error:  # a name may hold characters that file names cannot
        raise OutputError(f"{what}: {getattr(error, 'strerror', None) or error}") from error
