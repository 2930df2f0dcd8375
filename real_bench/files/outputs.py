"""Files that appear whole, and outputs that are checked before any work."""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from real_bench.errors import RealBenchError
from real_bench.files.kinds import FIRST_BYTES, WHOLE, FileKind

MOUNTS = Path("/proc/self/mountinfo")
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
    with _as_output_error(f"cannot write {path}"):
        status = _status(path)
        if status is not None and not stat.S_ISREG(status.st_mode):
            raise OutputError(f"{path} is {_describe_kind(status)}, not a file")
        real = real_path(path)
        hidden = real.with_name(f".{uuid4().hex[:12]}{real.suffix}")
        mode = 0o600 if status or is_secret else 0o666
        os.close(os.open(hidden, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode))
    try:
        with _as_output_error(f"cannot write {path}"):
            if status is not None and not is_secret:
                hidden.chmod(stat.S_IMODE(status.st_mode))
        try:
            yield hidden
        except OSError as error:
            if error.filename in (None, str(hidden)):  # else something else failed
                raise OutputError(f"cannot write {path}: {error.strerror or error}") from error
            raise
        with _as_output_error(f"cannot write {path}"):
            with hidden.open("rb") as written:
                os.fsync(written.fileno())
            hidden.replace(real)
    except BaseException:
        hidden.unlink(missing_ok=True)
        raise


def real_path(path: Path) -> Path:
    """Where a file is, all links followed; a circular link is reported when it is opened."""
    return Path(os.path.realpath(path))


def file_sha256(path: Path) -> str:
    """The hash of a file's content."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(1 << 20):
            digest.update(chunk)
    return digest.hexdigest()


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
    with _as_output_error(f"cannot write {path}"):
        status = _status(path)
        if status is not None:
            if not stat.S_ISREG(status.st_mode):
                raise OutputError(f"{path} is {_describe_kind(status)}, not a file")
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
    first = _first_bytes(path)
    return not first or kind.begins(first)


def _first_bytes(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(FIRST_BYTES)


def check_folder(folder: Path, *, make: bool = False) -> None:
    """Check before any work that files can be written into a folder.

    Args:
        folder: the folder.
        make: create it if it does not exist.

    Raises:
        OutputError: they cannot.
    """
    with _as_output_error(f"cannot write into {folder}"):
        if make:
            folder.mkdir(parents=True, exist_ok=True)
        tried = real_path(folder) / f".{uuid4().hex[:12]}"
        tried.touch(exist_ok=False)
        tried.unlink()


class Output:
    """An output written once, at the end of the work, but opened or checked at the beginning.

    A device or a pipe, e.g. /dev/stdout, is written to directly.

    Args:
        path: of the output.
        append: continue at the end of the file, in place, as several steps of a job do.
        overwrite: replace an existing file, unless it is appended to.
        kind: of the file; one of another kind is never replaced, unless it is empty.
        option: that names it, for messages.

    Raises:
        OutputError: it cannot be written.
    """

    def __init__(
        self,
        path: Path,
        *,
        append: bool = False,
        overwrite: bool = False,
        kind: FileKind | None = None,
        option: str = "--out",
    ) -> None:
        self._path, self._handle = path, -1
        with _as_output_error(f"cannot write {path}"):
            status = _status(path)
            is_file = status is None or stat.S_ISREG(status.st_mode)
            if append or not is_file:
                self._handle = self._opened(status)
            elif (handle := _own_stream(status)) is not None:
                self._handle = handle
            else:
                check_output(path, overwrite=overwrite, kind=kind, instead=f"another {option}")
        self._is_new = append and status is None

    def write(self, content: bytes) -> None:
        """Write all of it, or raise OutputError with the file unchanged."""
        if self._handle < 0:
            return write_atomically(self._path, content)
        with _as_output_error(f"cannot write {self._path}"):
            before = os.fstat(self._handle)
            left = memoryview(content)
            try:
                while left:
                    left = left[os.write(self._handle, left) :]
            except OSError:
                if stat.S_ISREG(before.st_mode):
                    with suppress(OSError):
                        os.ftruncate(self._handle, before.st_size)
                raise
            self._is_new = False

    def close(self) -> None:
        """Close it; removes a file that was created to be appended to, but was not."""
        if self._handle < 0:
            return
        is_empty = os.fstat(self._handle).st_size == 0  # else another process has written to it
        os.close(self._handle)
        self._handle = -1
        if self._is_new and is_empty:
            self._path.unlink(missing_ok=True)

    def __enter__(self) -> Output:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _opened(self, status: os.stat_result | None) -> int:
        if status is not None:
            own_stream = _own_stream(status)
            if own_stream is not None:
                return own_stream
            if stat.S_ISDIR(status.st_mode):
                raise OutputError(f"{self._path} is a folder, not a file")
            if stat.S_ISREG(status.st_mode):
                _check_writable(self._path, status)
                _check_appendable(self._path)
        how = os.O_WRONLY | os.O_APPEND | (os.O_CREAT if status is None else 0)
        try:
            handle = os.open(self._path, how | os.O_NONBLOCK | os.O_NOCTTY, 0o666)
        except OSError as error:
            if status is not None and stat.S_ISFIFO(status.st_mode):
                raise OutputError(f"{self._path} is a pipe that nobody reads") from error
            raise
        os.set_blocking(handle, True)
        return handle


def _own_stream(status: os.stat_result | None) -> int | None:
    """A second handle of our own standard output or error, if that is the file.

    If it were opened by name it would be overwritten, since each handle has its own position.
    """
    for handle in (1, 2):
        with suppress(OSError):
            if status is not None and os.path.samestat(status, os.fstat(handle)):
                return os.dup(handle)
    return None


def _check_replaceable(path: Path, status: os.stat_result) -> None:
    _check_writable(path, status)
    if (own_stream := _own_stream(status)) is not None:
        os.close(own_stream)
        raise OutputError(f"{path} is where this command prints to: use another file")
    if _is_mounted(real_path(path)):
        raise OutputError(
            f"{path} is mounted by itself and cannot be replaced: mount its folder instead"
        )


def _check_writable(path: Path, status: os.stat_result) -> None:
    """Refuse a protected file, even if root could write it."""
    if not status.st_mode & 0o222 or not os.access(path, os.W_OK):
        raise OutputError(f"{path} is read-only: make it writable (chmod u+w), or use another file")


def _check_appendable(path: Path) -> None:
    """Refuse a file that whatever is appended would spoil."""
    first = _first_bytes(path)
    for kind in WHOLE:
        if first and kind.begins(first):
            raise OutputError(f"{path} is a {kind.name}, so nothing is appended: use another file")


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


def _status(path: Path) -> os.stat_result | None:
    """The status of a path, links followed; None if nothing is there."""
    try:
        return path.stat()
    except FileNotFoundError:
        return None


def _describe_kind(status: os.stat_result) -> str:
    return KINDS.get(stat.S_IFMT(status.st_mode), "no file")


@contextmanager
def _as_output_error(what: str) -> Iterator[None]:
    """Turn the system's errors into ours."""
    try:
        yield
    except (OSError, ValueError) as error:  # a name may hold characters that file names cannot
        raise OutputError(f"{what}: {getattr(error, 'strerror', None) or error}") from error
