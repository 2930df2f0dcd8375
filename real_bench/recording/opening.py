"""Open an HDF5 file, also where the file system has no locks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py


def open_hdf5(path: Path, mode: str, **how: Any) -> h5py.File:
    """The file, open; raises what h5py raises, but for locks.

    Nothing here needs HDF5's own lock: what is read is never written in place, and whoever writes
    holds a lock of ours. Not asked for at all, it would keep others in this process from opening
    the file as they are used to.
    """
    try:
        return h5py.File(path, mode, **how)
    except OSError as error:
        if "lock" not in str(error).replace(str(path), ""):
            raise
        return h5py.File(path, mode, locking=False, **how)
