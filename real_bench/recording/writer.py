"""Write a recording so that it can be killed at any moment.

The file that the user sees is never written in place. Rows are appended to a hidden copy, which
then takes the visible file's place in one atomic rename; the file that was visible becomes the
next hidden copy, one batch behind, unless somebody still has it open, or has another name for it.
So a reader always finds a whole file that does not change while it reads, killing the writer loses
at most the rows since the last rename, and appending costs no more as the file grows.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import signal
import stat
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import h5py

from real_bench.errors import RecordingError
from real_bench.files.atomic import OutputError, real_path
from real_bench.files.locks import write_lock
from real_bench.recording.columns import to_columns
from real_bench.recording.header import Header
from real_bench.recording.opening import open_hdf5
from real_bench.recording.schema import LOGGED, Batch, create, create_table
from real_bench.recording.state import ControllerState, save_state
from real_bench.simulation.manifest import CameraSpec
from real_bench.text.quoting import one_line

FREE_SPACE = {"fs_strategy": "fsm", "fs_persist": True, "fs_threshold": 1}
"""HDF5 tracks freed space, so that rewritten chunks leave no holes."""

SPARE_BYTES = 1 << 14
COPIED_AT_ONCE = 1 << 20


class AppendOnlyFile:
    """An HDF5 file that grows by whole batches and is whole at every moment.

    Args:
        path: the visible file.

    Raises:
        RecordingError: another process is writing it, or it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._visible = real_path(path)  # a link to a recording stays a link
        self._hidden = self._visible.with_name(f".{self._visible.name}.part")
        self._spare = self._visible.with_name(f".{self._visible.name}.spare")
        self._before = self._visible.with_name(f".{self._visible.name}.before")
        self._is_empty = False  # begun here, and holds no action yet?
        self._behind: Batch | None = None  # what the hidden copy lacks; unknown without a copy
        self._tried: Batch | None = None  # appended, or interrupted while it was
        with ExitStack() as held:  # released in reverse: first the hidden files, then the lock
            try:
                held.enter_context(write_lock(path))
            except OutputError as error:
                raise RecordingError(str(error)) from error
            self._recover()
            held.callback(self._discard_copies)
            held.callback(self._undo_if_empty)
            self._held = held.pop_all()

    def create(self, header: Header, command_size: int, camera: CameraSpec) -> None:
        """Begin an empty recording in place of whatever was there.

        The old file comes back if this one is closed without an action in it.
        """
        with self._all_or_nothing():
            self._is_empty = True
            self._back_up()
            self._hidden.touch()
            if self._before.exists():
                shutil.copymode(self._before, self._hidden)
            self._reserve(0)
            with open_hdf5(self._hidden, "w", **FREE_SPACE) as file:
                create(file, header, command_size, camera)
            self._hidden.replace(self._visible)

    def append(self, batch: Batch) -> None:
        """Add rows, once however often the same batch is given.

        Raises:
            RecordingError: that fails; the visible file is unchanged.
        """
        with self._all_or_nothing():
            if not (batch is self._tried and self._has_rows_of(batch)):
                self._tried = batch
                self._catch_up()
                self._write(batch)
                with self._hidden.open("rb") as written:
                    os.fsync(written.fileno())
                self._behind = batch if self._swap() else None
            if self._is_empty and len(batch.transitions):
                self._is_empty = False
                self._before.unlink(missing_ok=True)

    def close(self) -> None:
        """Remove the hidden files and let others write."""
        self._held.close()

    def _recover(self) -> None:
        """Tidy up after a killed process."""
        self._discard_copies()
        if self._before.exists():
            self._is_empty = self._n_transitions() == 0
            self._undo_if_empty()

    def _back_up(self) -> None:
        """Give what was there a second name."""
        if self._visible.exists():
            try:
                os.link(self._visible, self._before)
            except OSError:  # the file system has no hard links
                self._visible.replace(self._before)

    def _undo_if_empty(self) -> None:
        if self._is_empty:
            if self._before.exists():
                self._before.replace(self._visible)
            else:
                self._visible.unlink(missing_ok=True)
        self._is_empty = False
        self._before.unlink(missing_ok=True)  # left where both names are of one file, too

    def _n_transitions(self) -> int:
        try:
            with open_hdf5(self._visible, "r") as file:
                return len(file["transitions"])
        except FileNotFoundError:
            return 0
        except (OSError, KeyError) as error:
            if self._visible.samefile(self._before):  # still what was there
                return 1
            raise RecordingError(
                f"{self.path} is no recording, and {self._before} is what a killed process was "
                "to replace: move one of them away"
            ) from error

    def _has_rows_of(self, batch: Batch) -> bool:
        """Whether the rows of an append that may have been interrupted are in the visible file."""
        with open_hdf5(self._visible, "r") as file:
            same_steps = int(file.attrs["n_steps"]) >= batch.n_steps
            same_end = bool(file.attrs["ended"]) == batch.ended
        return (len(batch.transitions) > 0 or batch.ended) and same_steps and same_end

    def _write(self, batch: Batch) -> None:
        self._reserve(batch.most_bytes)
        with open_hdf5(self._hidden, "r+") as file:
            _append(file, batch)

    def _reserve(self, n_bytes: int) -> None:
        """Reserve disk space first: HDF5 does not survive a failed write."""
        if hasattr(os, "posix_fallocate"):
            size = self._hidden.stat().st_size
            with self._hidden.open("r+b") as file:
                os.posix_fallocate(file.fileno(), 0, size + n_bytes + SPARE_BYTES)

    def _copy_visible(self) -> None:
        """Copy from one open file, which stays whole even if its name is removed meanwhile."""
        try:
            with self._visible.open("rb") as source, self._hidden.open("wb") as copy:
                self._hidden.chmod(stat.S_IMODE(os.fstat(source.fileno()).st_mode))
                shutil.copyfileobj(source, copy, COPIED_AT_ONCE)
        except FileNotFoundError as error:
            raise RecordingError(f"{self.path} was removed during the recording") from error

    def _catch_up(self) -> None:
        """Bring the hidden copy up to the visible file, and make sure that nobody else uses it."""
        if self._behind is not None and (self._is_exclusive() or not self._visible.exists()):
            if not self._is_exclusive():  # and somebody removed the other copy
                shutil.copy(self._hidden, self._spare)
                self._spare.replace(self._hidden)
            self._write(self._behind)
        else:
            self._hidden.unlink(missing_ok=True)
            self._copy_visible()

    def _is_exclusive(self) -> bool:
        """Whether nobody reads or names the hidden copy, from when it was the visible file.

        The system grants a write lease on a file only if it is open nowhere else.
        """
        if self._hidden.stat().st_nlink > 1 or not hasattr(fcntl, "F_SETLEASE"):
            return False
        with self._hidden.open("r+b") as file:
            try:
                # If somebody opens it meanwhile the system sends a signal, which is ignored.
                fcntl.fcntl(file.fileno(), fcntl.F_SETSIG, signal.SIGURG)
                fcntl.fcntl(file.fileno(), fcntl.F_SETLEASE, fcntl.F_WRLCK)
                fcntl.fcntl(file.fileno(), fcntl.F_SETLEASE, fcntl.F_UNLCK)
            except OSError:
                return False
        return True

    def _swap(self) -> bool:
        """Swap the hidden copy and the visible file.

        False if the file system has no hard links; then the old file is gone.
        """
        try:
            os.link(self._visible, self._spare)
        except OSError:
            self._hidden.replace(self._visible)
            return False
        self._hidden.replace(self._visible)
        self._spare.replace(self._hidden)
        return True

    def _discard_copies(self) -> None:
        self._behind = None
        for path in (self._hidden, self._spare):
            path.unlink(missing_ok=True)

    @contextmanager
    def _all_or_nothing(self) -> Iterator[None]:
        try:
            yield
        except (OSError, RuntimeError) as error:
            self._discard_copies()
            reason = getattr(error, "strerror", None) or one_line(error)
            kept = "earlier rows are safe (fix the cause, then use --resume)"
            if self._is_empty:
                kept = "nothing was recorded"
            raise RecordingError(f"cannot write {self.path}: {reason}; {kept}") from error
        except BaseException:
            self._discard_copies()
            raise


def _append(file: h5py.File, batch: Batch) -> None:
    if len(batch.logged) and "logged" not in file:  # a recording of schema version 1
        create_table(file, "logged", LOGGED)
    for name, rows in batch.datasets().items():
        if len(rows):
            dataset = file[name]
            before = len(dataset)
            dataset.resize(before + len(rows), axis=0)
            dataset[before:] = to_columns(rows, dataset.dtype)
    file.attrs["n_steps"] = batch.n_steps
    file.attrs["total_steps"] = batch.total_steps
    file.attrs["ended"] = batch.ended
    if batch.commands_sha256 is not None:
        file.attrs["commands_sha256"] = batch.commands_sha256
    _replace(file, "controller_state", batch.controller_state)
    if batch.controller_files is not None:
        _replace(file, "controller_files", dict(batch.controller_files))


def _replace(file: h5py.File, name: str, state: ControllerState) -> None:
    if name in file:
        del file[name]
    save_state(file.create_group(name), state)
