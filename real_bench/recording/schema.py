"""The layout of a recording (HDF5), in one place.

::

    /                      attributes: format, schema_version, the header's fields,
                           n_steps (so far), total_steps (asked for), ended (its last hook, too),
                           commands_sha256 (see chained_sha256; absent in recordings before it)
    /transitions           one row per action: the triplet (s, a, s') by row numbers
        precondition, outcome    rows of /states (and /images, /ground_truth)
        first_command, n_commands, first_step, n_steps
    /commands              one row per command: command (size,), n_steps, line
    /states                joint_positions (9,), touch_sensors (4,), step
    /images                (m, 240, 320, 3) uint8, one per state, if images are recorded
    /ground_truth/object_poses   position and quaternion of each object per state; for analysis
    /logged                what the controller logged: steps and actions over by then, name, value
    /cuts                  where a run was resumed: step, and what the controller and the
                           packages were from there on; a fresh world began there
    /controller_state      what the controller hands over
    /controller_files      what an isolated controller wrote into its working directory, by name
                           (absent in early recordings)

Tables have a column for each number (joint_positions_0 ... joint_positions_8, cube_x ... cube_qw;
see :mod:`real_bench.recording.columns`) and are packed by gzip, so that plain h5py and pandas read
them. Images are packed by zstd, which needs hdf5plugin. Recordings of schema version 1 have fields
of several numbers, poses of shape (m, n_objects, 7), all packed by zstd, and nothing logged until
they are resumed.

An excerpt for an isolated controller (attribute excerpt) has an empty controller_state and, if
positions must not be seen, no ground_truth.

The outcome of one action is the precondition of the next, so each state is stored once. After a
cut a fresh world begins at the recorded poses, so the first action has a state of its own.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import h5py
import hdf5plugin
import numpy as np
from numpy.typing import NDArray

from real_bench.files.kinds import RUN_FORMAT
from real_bench.logbook import MAX_NAME_LENGTH
from real_bench.recording.columns import flat, pose_type
from real_bench.recording.header import Header
from real_bench.recording.state import ControllerState, state_bytes
from real_bench.simulation.manifest import CameraSpec

SCHEMA_VERSION = 2
READABLE_VERSIONS = (1, 2)

IMAGES_PER_CHUNK = 16
ROWS_PER_CHUNK = 1024
POSES = "ground_truth/object_poses"

TRANSITION = np.dtype(
    [
        ("precondition", "<i8"),
        ("outcome", "<i8"),
        ("first_command", "<i8"),
        ("n_commands", "<i8"),
        ("first_step", "<i8"),
        ("n_steps", "<i8"),
    ]
)
STATE = np.dtype(
    [("joint_positions", "<f8", (9,)), ("touch_sensors", "<f8", (4,)), ("step", "<i8")]
)
CUT = np.dtype([("step", "<i8"), ("controller_sha256", "S64"), ("versions", "S1024")])
LOGGED = np.dtype(
    [("step", "<i8"), ("action", "<i8"), ("name", f"S{MAX_NAME_LENGTH}"), ("value", "<f8")]
)


def with_text(logged: NDArray[Any]) -> NDArray[Any]:
    """Rows of ``LOGGED`` with names as text; equal ones are one object, since there may be many."""
    names = logged["name"].tolist()
    texts = {name: name.decode(errors="replace") for name in set(names)}
    columns = LOGGED.names or ()
    rows = np.empty(
        len(logged), [(key, object if key == "name" else LOGGED[key]) for key in columns]
    )
    for key in columns:
        rows[key] = [texts[name] for name in names] if key == "name" else logged[key]
    return rows


def chained_sha256(before: str, n_commands: NDArray[np.int64], commands: NDArray[Any]) -> str:
    """A hash of all commands so far, however they were written.

    A replay alone would not reveal every change of a command: beyond a limit, or in its last bit,
    a change may have no effect.

    Args:
        before: the hash of the actions before; empty if there are none.
        n_commands: how many commands each further action has.
        commands: these commands.
    """
    for rows in np.split(commands, np.cumsum(n_commands)[:-1]) if len(n_commands) else ():
        before = hashlib.sha256(before.encode() + rows.tobytes()).hexdigest()
    return before


def command_type(size: int) -> np.dtype[Any]:
    """The row type of /commands for command vectors of a size."""
    return np.dtype([("command", "<f8", (size,)), ("n_steps", "<i8"), ("line", "u1")])


RowType = tuple[np.dtype[Any], tuple[int, ...]]


def stored_types(
    version: int, command_size: int, object_names: Sequence[str]
) -> dict[str, RowType]:
    """How the file stores each table: type of a row, and its shape.

    Args:
        version: of the schema.
        command_size: of a command vector.
        object_names: their names, in order.
    """
    rows = {"transitions": TRANSITION, "commands": command_type(command_size), "states": STATE}
    if version == 1:
        poses: RowType = (np.dtype("<f8"), (len(object_names), 7))
        return {
            **{name: (dtype, ()) for name, dtype in rows.items()},
            "cuts": (CUT, ()),
            POSES: poses,
        }
    flattened: dict[str, RowType] = {name: (flat(dtype), ()) for name, dtype in rows.items()}
    return {**flattened, "cuts": (CUT, ()), POSES: (pose_type(object_names), ())}


def packing(name: str) -> dict[str, Any]:
    """How a dataset is packed, as arguments of ``create_dataset``."""
    if name == "images":
        return dict(hdf5plugin.Zstd(clevel=3))
    return {"compression": "gzip", "compression_opts": 1, "shuffle": True}


@dataclass(frozen=True, eq=False)
class Batch:
    """Rows that belong together; the names are those of the datasets.

    ``commands_sha256`` is of all commands up to these; None if the file has no hash.
    ``controller_files``: None if they are unchanged.
    """

    transitions: NDArray[Any]
    commands: NDArray[Any]
    states: NDArray[Any]
    images: NDArray[np.uint8] | None
    object_poses: NDArray[np.float64]
    cuts: NDArray[Any]
    n_steps: int
    total_steps: int
    ended: bool
    controller_state: ControllerState
    commands_sha256: str | None
    controller_files: Mapping[str, bytes] | None = None
    logged: NDArray[Any] = field(default_factory=lambda: np.empty(0, LOGGED))

    def datasets(self) -> dict[str, NDArray[Any]]:
        """The rows by the path of their dataset."""
        rows: dict[str, NDArray[Any]] = {
            "transitions": self.transitions,
            "commands": self.commands,
            "states": self.states,
            POSES: self.object_poses,
            "cuts": self.cuts,
            "logged": self.logged,
        }
        if self.images is not None:
            rows["images"] = self.images
        return rows

    @property
    def most_bytes(self) -> int:
        """The most disk space that writing the batch may take; images shrink to a tenth or less."""
        rows = self.datasets()
        images = rows.pop("images", np.empty(0))
        n_bytes = sum(array.nbytes for array in rows.values()) + state_bytes(self.controller_state)
        n_bytes += state_bytes(dict(self.controller_files or {}))
        return 2 * n_bytes + images.nbytes // 8


def create(file: h5py.File, header: Header, command_size: int, camera: CameraSpec) -> None:
    """Lay out an empty recording."""
    file.attrs["format"] = RUN_FORMAT
    file.attrs["schema_version"] = SCHEMA_VERSION
    file.attrs["n_steps"] = file.attrs["total_steps"] = 0
    file.attrs["ended"] = False
    file.attrs["commands_sha256"] = ""
    for key, value in header.to_attributes().items():
        file.attrs[key] = value
    types = stored_types(SCHEMA_VERSION, command_size, header.object_names)
    for name, (dtype, shape) in types.items():
        create_table(file, name, dtype, shape)
    create_table(file, "logged", LOGGED)
    file.create_group("controller_state")
    file.create_group("controller_files")
    if header.images:
        picture = (camera.height, camera.width, 3)
        create_table(file, "images", np.dtype("u1"), picture, IMAGES_PER_CHUNK)


def create_table(
    file: h5py.File,
    name: str,
    dtype: np.dtype[Any],
    shape: tuple[int, ...] = (),
    rows_per_chunk: int = ROWS_PER_CHUNK,
) -> None:
    """An empty dataset that can grow."""
    file.create_dataset(
        name,
        shape=(0, *shape),
        maxshape=(None, *shape),
        dtype=dtype,
        chunks=(rows_per_chunk, *shape),
        **packing(name),
    )
