"""Write a recording so that it can be killed at any moment.

The file that the user sees is never written in place. Rows are appended to a hidden copy, which
then takes the visible file's place in one atomic rename; the file that was visible becomes the
next hidden copy, one batch behind. So a reader always finds a whole file, killing the writer loses
at most the rows since the last rename, and appending costs no more as the file grows.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

import h5py
from filelock import FileLock, Timeout

from real_bench.errors import RecordingError
from real_bench.recording.header import Header
from real_bench.recording.schema import Batch, create
from real_bench.recording.state import save_state
from real_bench.simulation.scene import Camera


class AppendOnlyFile:
    """An HDF5 file that grows by whole batches and is whole at every moment.

    Args:
        path: the visible file.

    Raises:
        RecordingError: another process is writing it, or it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._hidden = path.with_name(f".{path.name}.part")
        self._spare = path.with_name(f".{path.name}.spare")
        self._lock = FileLock(path.with_name(f".{path.name}.lock"), timeout=0)
        self._behind: Batch | None = None  # what the hidden copy lacks; unknown without a copy
        try:
            self._lock.acquire()
        except Timeout as error:
            raise RecordingError(f"{path} is being written by another process") from error
        except OSError as error:
            raise RecordingError(f"cannot write {path}: {error.strerror or error}") from error
        self._discard_copies()

    def create(self, header: Header, command_size: int, camera: Camera) -> None:
        """Begin an empty recording in place of whatever was there."""
        try:
            with _open(self._hidden, "w") as file:
                create(file, header, command_size, camera)
            self._hidden.replace(self.path)
        except OSError as error:
            raise self._fault(error) from error

    def append(self, batch: Batch) -> None:
        """Add rows; raises RecordingError, with the visible file as it was, where that fails."""
        try:
            self._catch_up()
            with _open(self._hidden, "r+") as file:
                _append(file, batch)
            with self._hidden.open("rb") as written:
                os.fsync(written.fileno())
            self._swap()
            self._behind = batch
        except (OSError, RuntimeError) as error:
            self._discard_copies()
            raise self._fault(error) from error

    def close(self) -> None:
        """Remove the hidden files and let others write."""
        if self._lock.is_locked:
            self._discard_copies()
            self._lock.release()
            Path(self._lock.lock_file).unlink(missing_ok=True)

    def _catch_up(self) -> None:
        """Bring the hidden copy to what the visible file holds."""
        if self._behind is not None and self._hidden.exists():
            try:
                with _open(self._hidden, "r+") as file:
                    _append(file, self._behind)
                return
            except BlockingIOError:  # somebody still reads the file that this copy was
                self._hidden.unlink()
        shutil.copyfile(self.path, self._hidden)

    def _swap(self) -> None:
        try:
            os.link(self.path, self._spare)
        except OSError:  # a file system without hard links: the next batch copies the file
            self._hidden.replace(self.path)
            return
        self._hidden.replace(self.path)
        self._spare.replace(self._hidden)

    def _discard_copies(self) -> None:
        self._behind = None
        for path in (self._hidden, self._spare):
            path.unlink(missing_ok=True)

    def _fault(self, error: Exception) -> RecordingError:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split())
        return RecordingError(
            f"cannot write {self.path}: {reason}; what was recorded before is safe "
            "(make room or mend it, then use --resume)"
        )


def _open(path: Path, mode: str) -> h5py.File:
    """Open for writing; freed space is kept account of, so that rewritten chunks leave no holes."""
    if mode == "w":
        return h5py.File(path, mode, fs_strategy="fsm", fs_persist=True, fs_threshold=1)
    return h5py.File(path, mode)


def _append(file: h5py.File, batch: Batch) -> None:
    for name, rows in batch.datasets().items():
        if len(rows):
            dataset = file[name]
            before = len(dataset)
            dataset.resize(before + len(rows), axis=0)
            dataset[before:] = rows
    file.attrs["n_steps"] = batch.n_steps
    file.attrs["total_steps"] = batch.total_steps
    if batch.controller_state is not None:
        _replace_state(file, batch.controller_state)


def _replace_state(file: h5py.File, state: dict[str, Any]) -> None:
    del file["controller_state"]
    save_state(file.create_group("controller_state"), state)
