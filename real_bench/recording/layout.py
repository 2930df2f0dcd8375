"""What the file of a recording must hold, checked before it is read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from real_bench.errors import RecordingError
from real_bench.files.kinds import RUN_FORMAT
from real_bench.recording.header import Header
from real_bench.recording.schema import LOGGED, POSES, READABLE_VERSIONS, stored_types
from real_bench.recording.validation import (
    check_attributes,
    check_dataset,
    check_group,
    check_images,
    check_pieces,
    check_sizes,
)
from real_bench.text.counting import counted


def read_version(file: h5py.File, path: Path) -> int:
    """The version of its schema; raises RecordingError for what this realbench cannot read."""
    check_attributes(file)
    if file.attrs.get("format") != RUN_FORMAT:
        raise RecordingError(f"{path} is not a recording of realbench")
    version = int(file.attrs.get("schema_version", 0))
    if version not in READABLE_VERSIONS:
        raise RecordingError(
            f"{path} has schema version {version}; this realbench reads versions "
            f"{' and '.join(map(str, READABLE_VERSIONS))} (install a newer realbench)"
        )
    return version


def check_layout(file: h5py.File, version: int, header: Header) -> None:
    """Raise ValueError if a group or table is missing, of another type, or too large to read."""
    names = header.object_names
    if len(names) != header.objects:
        raise ValueError(
            f"it has {counted(len(names), 'name')} for {counted(header.objects, 'object')}"
        )
    rows = stored_types(version, header.command_size, names)
    for group in ("ground_truth", "controller_state", "controller_files"):
        check_group(file, group)
    if "ground_truth" not in file:  # see check_rows
        del rows[POSES]
    if "logged" in file:
        rows["logged"] = (LOGGED, ())
    for name, (dtype, shape) in rows.items():
        check_dataset(file, name, dtype, shape)
    if "images" in file:
        check_images(file, "images")
    check_sizes(file, rows)
    for name in rows.keys() - {"commands"}:  # whose pieces are checked when they are read
        check_pieces(file[name])


def check_rows(file: h5py.File, transitions: NDArray[Any], n_steps: int) -> None:
    """Raise ValueError if the rows of the tables do not fit together.

    All states have true poses, but in an excerpt for a controller none has.
    """
    n_states = len(file["states"])
    has_poses = not file.attrs.get("excerpt", False)
    good = (
        (not has_poses or len(file[POSES]) == n_states)
        and ("images" not in file or len(file["images"]) == n_states)
        and int(transitions["n_steps"].sum()) == n_steps
        and (transitions["n_commands"] >= 1).all()
        and int(transitions["n_commands"].sum()) == len(file["commands"])
        and _follow_one_another(transitions["first_command"], transitions["n_commands"])
        and _follow_one_another(transitions["first_step"], transitions["n_steps"])
        and _are_in_order(transitions["precondition"], transitions["outcome"], n_states)
    )
    if not good:
        raise ValueError("its rows do not fit together")


def _follow_one_another(first: NDArray[np.int64], n: NDArray[np.int64]) -> bool:
    """Whether each row begins where the one before it ended."""
    return bool(np.array_equal(first, np.cumsum(n) - n))


def _are_in_order(before: NDArray[np.int64], after: NDArray[np.int64], n_states: int) -> bool:
    """Whether each action leads from a state to the next one, from the first state on."""
    return bool(
        (before[:1] == 0).all()
        and (np.diff(before) >= 1).all()
        and np.array_equal(after, before + 1)
        and (after < n_states).all()
    )
