"""Outputs that are written at the end of the work: files, devices and pipes."""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from pathlib import Path

from real_bench.files.atomic import OutputError, as_output_error, status_of, write_atomically
from real_bench.files.kinds import WHOLE, FileKind, first_bytes
from real_bench.files.outputs import check_output, check_writable, own_stream


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
        with as_output_error(f"cannot write {path}"):
            status = status_of(path)
            is_file = status is None or stat.S_ISREG(status.st_mode)
            if append or not is_file:
                self._handle = self._opened(status)
            elif (handle := own_stream(status)) is not None:
                self._handle = handle
            else:
                check_output(path, overwrite=overwrite, kind=kind, instead=f"another {option}")
        self._is_new = append and status is None

    def write(self, content: bytes) -> None:
        """Write all of it, or raise OutputError with the file unchanged."""
        if self._handle < 0:
            return write_atomically(self._path, content)
        with as_output_error(f"cannot write {self._path}"):
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
            if (handle := own_stream(status)) is not None:
                return handle
            if stat.S_ISDIR(status.st_mode):
                raise OutputError(f"{self._path} is a folder, not a file")
            if stat.S_ISREG(status.st_mode):
                check_writable(self._path, status)
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


def _check_appendable(path: Path) -> None:
    """Refuse a file that whatever is appended would spoil."""
    first = first_bytes(path)
    for kind in WHOLE:
        if first and kind.begins(first):
            raise OutputError(f"{path} is a {kind.name}, so nothing is appended: use another file")
