"""Rows as stored in the file: one number per column, so that any reader of tables can read them.

In memory a state has nine joint positions in one field; in the file it has nine columns. The
bytes are the same, so rows are viewed differently, never converted.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

POSE_AXES = ("x", "y", "z", "qx", "qy", "qz", "qw")


def flat(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """A row type with a column for each number: ``touch_sensors`` of four is ``touch_sensors_0``
    to ``touch_sensors_3``."""  # noqa: D205, D209
    columns: list[tuple[str, np.dtype[Any]]] = []
    for name in dtype.names or ():
        kind = dtype[name]
        if kind.shape:
            columns += [(f"{name}_{number}", kind.base) for number in range(kind.shape[0])]
        else:
            columns.append((name, kind))
    return np.dtype(columns)


def pose_type(object_names: Sequence[str]) -> np.dtype[Any]:
    """The row type of the objects' poses: ``cube_x``, ..., ``cube_qw``, and so on.

    Raises:
        ValueError: two objects have the same name.
    """
    return np.dtype([(f"{name}_{axis}", "<f8") for name in object_names for axis in POSE_AXES])


def to_columns(rows: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Rows as a dataset of this type takes them; there must be at least one."""
    if rows.dtype == dtype:
        return rows
    return np.ascontiguousarray(rows).reshape(len(rows), -1).view(dtype).reshape(len(rows))


def read_poses(rows: NDArray[Any], n_objects: int) -> NDArray[np.float64]:
    """Poses as they were read, as an array (m, n_objects, 7)."""
    return rows.view("<f8").reshape(len(rows), n_objects, len(POSE_AXES))
