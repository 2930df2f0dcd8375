"""Open an HDF5 file, even on a file system without locks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py


def open_hdf5(path: Path, mode: str, **options: Any) -> h5py.File:
    """The file, open; raises what h5py raises, except about locks.

    HDF5's own lock is not needed: what is read is never written in place, and writers hold a lock
    of ours. It is not switched off entirely, since then others in this process could not open the
    file in the usual way.
    """
    if path.is_dir():
        raise IsADirectoryError("it is a folder")
    try:
        return h5py.File(path, mode, **options)
    except OSError as error:
        if "lock" not in str(error).replace(str(path), ""):
            raise
        return h5py.File(path, mode, locking=False, **options)
