"""Locks on files that die with the process that holds them, and private temporary folders."""

from __future__ import annotations

import errno
import fcntl
import logging
import os
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from real_bench.files.atomic import OutputError, real_path

_logger = logging.getLogger(__name__)

NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL)
HELD = (errno.EWOULDBLOCK, errno.EACCES)


@contextmanager
def write_lock(path: Path, *, wait_while: str = "") -> Iterator[bool]:
    """Be the only process that writes a file.

    The lock dies with the process that holds it. If the file system has no locks, a warning is
    logged and the file is written without one: then False is given, otherwise True.

    Args:
        path: of the file.
        wait_while: what another process may be doing, for the message: then wait until it has.

    Raises:
        OutputError: another process writes it (and we do not wait), or nobody can.
    """
    real = real_path(path)
    lock = real.with_name(f".{real.name}.lock")
    try:
        handle = _acquire(lock, wait_while)
    except BlockingIOError as error:
        raise OutputError(f"{path} is being written by another process") from error
    except OSError as error:
        if error.errno not in NO_LOCKS:
            reason = error.strerror or error
            raise OutputError(f"cannot write into {path.parent}: {reason}") from error
        lock.unlink(missing_ok=True)
        _logger.warning(
            "%s is on a file system without locks: no other process must write it now", path
        )
        yield False
        return
    try:
        yield True
    finally:
        lock.unlink(missing_ok=True)
        os.close(handle)


def is_being_written(path: Path) -> bool:
    """Whether a process holds the lock on a file; always false without file system locks."""
    real = real_path(path)
    try:
        handle = os.open(real.with_name(f".{real.name}.lock"), os.O_RDONLY | os.O_NOFOLLOW)
    except OSError:  # a process that ends properly removes it
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno in HELD
    finally:
        os.close(handle)
    return False


def _acquire(lock: Path, wait_while: str) -> int:
    """A handle that holds the lock; raises BlockingIOError if another one does."""
    how = fcntl.LOCK_EX | fcntl.LOCK_NB
    while True:
        handle = os.open(lock, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
        try:
            fcntl.flock(handle, how)
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(handle), lock.stat()):
                    return handle
            os.close(handle)  # whoever held it removed it after it was opened here
        except OSError as error:
            os.close(handle)
            if error.errno not in HELD:
                raise
            if not wait_while:
                raise BlockingIOError from error
            _logger.info("waiting while another process %s", wait_while)
            how = fcntl.LOCK_EX
        except BaseException:  # a wish to stop, while waiting
            os.close(handle)
            raise


@contextmanager
def temporary_folder(prefix: str, *, within: Path | None = None) -> Iterator[Path]:
    """A new temporary folder that does not outlive its use.

    If its process is killed, the next call with the same prefix removes it. Raises OutputError if
    none can be made.

    Args:
        prefix: of its name.
        within: the folder to make it in; None: the system's.
    """
    try:
        place = real_path(within or Path(tempfile.gettempdir()))
    except OSError as error:
        raise OutputError(f"cannot make a temporary folder: {error}") from error
    for leftover in place.glob(prefix + "[0-9a-f]" * 32):  # each was locked before it was made
        with suppress(OSError, OutputError):
            found = leftover.lstat()
            if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid():
                with write_lock(leftover) as is_unused:  # refused if it is in use
                    if is_unused:
                        _remove(leftover)
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
    """Remove a folder, whatever a stranger has put into it; fails silently."""
    with suppress(OSError, RecursionError):
        return shutil.rmtree(folder)
    for command in (["chmod", "-R", "u+rwx"], ["rm", "-rf"]):  # however deep or protected
        with suppress(OSError):
            subprocess.run([*command, "--", str(folder)], capture_output=True, check=False)
