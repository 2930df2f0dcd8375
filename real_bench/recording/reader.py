"""Read a recording, even one that is being written or was interrupted."""

from __future__ import annotations

import json
import operator
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import h5py
import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action
from real_bench.errors import RecordingError
from real_bench.inputs.numeric import short
from real_bench.recording.arrays import MOMENTS, images_of, table_of
from real_bench.recording.columns import read_poses
from real_bench.recording.header import Header
from real_bench.recording.images import ImageReader
from real_bench.recording.layout import check_layout, check_rows, read_version
from real_bench.recording.opening import open_hdf5
from real_bench.recording.schema import (
    LOGGED,
    POSES,
    STATE,
    command_type,
    with_text,
)
from real_bench.recording.state import ControllerState, load_state
from real_bench.recording.triplet import State, Triplet
from real_bench.recording.validation import (
    check_dataset,
    check_pieces,
    check_sizes,
)
from real_bench.text.counting import counted
from real_bench.text.quoting import one_line

if TYPE_CHECKING:
    from real_bench.recording.torch_dataset import TripletDataset

MOVED_M = 0.01
"""An object counts as moved if an action displaced it by more (paper, section Results)."""

MAX_CACHED_BYTES = 2**26
"""Commands of whole actions take less, those of controllers called at every step more."""


class Recording:
    """A recording open for reading.

    Raises:
        RecordingError: the file does not exist, is not a recording, is damaged, or was written by
            a newer version.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = path = Path(path)
        with self._guard():
            self._file = open_hdf5(path, "r")
        try:
            with self._guard():
                version = read_version(self._file, path)
                self.header = Header.from_attributes(dict(self._file.attrs))
                check_layout(self._file, version, self.header)
                self.n_steps = int(self._file.attrs["n_steps"])
                self.transitions: NDArray[Any] = self._file["transitions"][()]
                self.total_steps = int(self._file.attrs["total_steps"])
                self.ended = bool(self._file.attrs["ended"])
                stored = self._file.attrs.get("commands_sha256")
                self.commands_sha256 = None if stored is None else str(stored)
                cuts = self._file["cuts"][()]
                self.cuts: list[int] = cuts["step"].tolist()
                code = [each.decode() for each in cuts["controller_sha256"]]
                code.insert(0, self.header.controller_sha256)
                self.code_sha256 = code[-1]
                self.code_changes = [
                    step
                    for step, before, after in zip(self.cuts, code[:-1], code[1:], strict=True)
                    if before != after
                ]
                self.n_states = len(self._file["states"])
                check_rows(self._file, self.transitions, self.n_steps)
        except BaseException:
            self._file.close()
            raise

    @property
    def file(self) -> h5py.File:
        """The file itself, open for reading."""
        return self._file

    @property
    def n_commands(self) -> int:
        """How many command rows there are."""
        self._check_open()
        return len(self._file["commands"])

    @property
    def n_images(self) -> int | None:
        """How many images there are: one per state, or None if images are not recorded."""
        self._check_open()
        return len(self._file["images"]) if "images" in self._file else None

    def commands(self, first: int = 0, count: int | None = None) -> NDArray[Any]:
        """Command rows: vector, duration, line; by default all of them."""
        with self._guard():
            end = None if count is None else first + count
            check_pieces(self._file["commands"], first, end)
            rows: NDArray[Any] = self._file["commands"][first:end]
        return rows.view(command_type(self.header.command_size))

    def __len__(self) -> int:
        """How many triplets there are; a recording without any is still true."""
        return len(self.transitions)

    def __bool__(self) -> bool:
        return True

    def __repr__(self) -> str:
        what = f"{counted(len(self), 'triplet')}, {self.header.condition}, {self.header.scene}"
        return f"<Recording {self.path}: {what}>"

    def __iter__(self) -> Iterator[Triplet]:
        """The triplets in the order in which they were recorded, each read when it is asked for."""
        return (self[number] for number in range(len(self)))

    @overload
    def __getitem__(self, index: int) -> Triplet: ...

    @overload
    def __getitem__(self, index: slice | Sequence[int] | NDArray[Any]) -> list[Triplet]: ...

    def __getitem__(
        self, index: int | slice | Sequence[int] | NDArray[Any]
    ) -> Triplet | list[Triplet]:
        """A triplet, or several by a slice or their numbers, with images if there are any.

        Raises:
            IndexError: there is no such triplet.
            RecordingError: the recording is closed, or damaged.
        """
        self._check_open()
        if isinstance(index, slice):
            return [self[number] for number in range(len(self))[index]]
        if isinstance(index, list | tuple | range | np.ndarray) and np.ndim(index) == 1:
            return [self[number] for number in index]
        try:
            if isinstance(index, bool):  # a mask would give the first two triplets again and again
                raise TypeError
            number = operator.index(index)  # type: ignore[arg-type]
        except TypeError:
            raise IndexError(
                f"triplets are told by numbers, a slice or a list of numbers, not {short(index)}"
            ) from None
        if not -len(self) <= number < len(self):
            raise IndexError(f"triplet {number} of {len(self)}")
        row = self.transitions[number % len(self)]
        before, after = int(row["precondition"]), int(row["outcome"])
        rows = self._commands_of(int(row["first_command"]), int(row["n_commands"]))
        pair = (None, None) if self.n_images is None else self.image_pair(before, after)
        return Triplet(
            self._state(before, pair[0]),
            Action.from_rows(rows),
            self._state(after, pair[1]),
        )

    def to_numpy(
        self,
        *,
        images: bool = False,
        image_size: tuple[int, int] | None = None,
        cache: str | Path | None = None,
    ) -> dict[str, NDArray[Any]]:
        """All triplets as arrays by name, one row per triplet.

        Args:
            images: include full-size images; 0.5 MB per triplet.
            image_size: include images shrunk to this width and height.
            cache: a folder in which images are kept, so that they are made only once.

        Returns:
            ``joint_positions_before``, ``joint_positions_after`` (n, 9) radians; ``touch_sensors_``
            (n, 4) newtons; ``object_poses_`` (n, n_objects, 7) metres and quaternion, the truth;
            ``image_`` (n, height, width, 3) uint8; ``commands`` (n, k, size), ``n_steps`` (n, k)
            and ``line`` (n, k) with the longest action's k commands, 0 where an action has fewer.

        Raises:
            RecordingError: images are asked for, but there are none.
        """
        with self._guard():
            table = table_of(self)
        if images or image_size is not None:
            folder = None if cache is None else Path(cache)
            taken = images_of(self, image_size, folder)
            for moment, column in MOMENTS.items():
                table[f"image_{moment}"] = taken[self.transitions[column]]
        return table

    def torch_dataset(
        self, *, image_size: tuple[int, int] | None = None, cache: str | Path | None = None
    ) -> TripletDataset:
        """The triplets as a torch dataset, with the names of :meth:`to_numpy`.

        Args:
            image_size: width and height to which images are shrunk, once, in memory; None: as
                recorded, read on demand.
            cache: a folder in which images are kept, so that they are made only once.

        Raises:
            RecordingError: a size is asked for, but there are no images.
        """
        from real_bench.recording.torch_dataset import TripletDataset

        return TripletDataset(self, image_size, None if cache is None else Path(cache))

    def images(self, first: int = 0, count: int | None = None) -> NDArray[np.uint8]:
        """Camera images of states, (count, height, width, 3) uint8; by default all of them."""
        reader = self._image_reader
        with self._guard():
            return reader.read(first, count)

    def image_pair(self, before: int, after: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """The images of two states, each (height, width, 3) uint8; neighbours are read at once."""
        reader = self._image_reader
        with self._guard():
            return reader.pair(before, after)

    @property
    def image_shape(self) -> tuple[int, int, int]:
        """Height, width, 3 of one image; raises RecordingError if there are none."""
        return self._image_reader.shape

    @property
    def states(self) -> NDArray[Any]:
        """Joint positions, touch sensors and step of every state, as a structured array."""
        with self._guard():
            states: NDArray[Any] = self._file["states"][()]
        return states.view(STATE)

    @property
    def has_poses(self) -> bool:
        """Whether it holds the objects' true poses; an excerpt for a controller may lack them."""
        self._check_open()
        return "ground_truth" in self._file

    @property
    def object_poses(self) -> NDArray[np.float64]:
        """True poses of the objects in every state, (m, n_objects, 7). For analysis."""
        if not self.has_poses:
            raise RecordingError(f"{self.path} is an excerpt for a controller, without positions")
        with self._guard():
            return read_poses(self._file[POSES][()], self.header.objects)

    @property
    def logged(self) -> NDArray[Any]:
        """What the controller logged, in order: step, action, name, value, a structured array.

        Step and action count those that were over when it was logged; names are text.
        """
        self._check_open()
        if "logged" not in self._file:
            return with_text(np.empty(0, LOGGED))
        with self._guard():
            return with_text(self._file["logged"][()])

    @property
    def parts(self) -> list[dict[str, str]]:
        """The versions that each part was played with; every cut begins a new part."""
        with self._guard():
            stored = [json.loads(versions) for versions in self._file["cuts"]["versions"]]
            if not all(isinstance(versions, dict) for versions in stored):
                raise ValueError("the versions of a part are not names and values")
        return [self.header.versions, *stored]

    def controller_state(self) -> ControllerState:
        """What the controller handed over; empty if nothing."""
        return self._load_state("controller_state")

    def controller_files(self) -> dict[str, bytes]:
        """What an isolated controller wrote into its working directory, by name."""
        files = self._load_state("controller_files")
        if not all(isinstance(content, bytes) for content in files.values()):
            raise RecordingError(f"{self.path} is damaged: a controller's file does not hold bytes")
        return files

    def displacements(self) -> NDArray[np.float64]:
        """How far each action moved each object, (t, n_objects) metres."""
        positions = self.object_poses[:, :, :3]
        before = positions[self.transitions["precondition"]]
        after = positions[self.transitions["outcome"]]
        return np.asarray(np.linalg.norm(after - before, axis=2), np.float64)

    def share_moved(self) -> float:
        """The share of actions that moved an object by more than 1 cm; NaN without actions."""
        moved = np.asarray(self.displacements() > MOVED_M).any(axis=1)
        return float(np.mean(moved)) if len(self.transitions) else float("nan")

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @cached_property
    def _image_reader(self) -> ImageReader:
        self._check_open()
        if "images" not in self._file:
            raise RecordingError(f"{self.path} was recorded without images")
        return ImageReader(self._file["images"])

    @cached_property
    def _states_and_poses(self) -> tuple[NDArray[Any], NDArray[np.float64] | None]:
        """States and poses, read once for all triplets that are read one by one."""
        return self.states, self.object_poses if self.has_poses else None

    @cached_property
    def _all_commands(self) -> NDArray[Any] | None:
        """All commands, if they fit in memory."""
        fits_in_memory = self.n_commands * self._file["commands"].dtype.itemsize <= MAX_CACHED_BYTES
        return self.commands() if fits_in_memory else None

    def _commands_of(self, first: int, count: int) -> NDArray[Any]:
        known = self._all_commands
        return self.commands(first, count) if known is None else known[first : first + count]

    def _state(self, number: int, image: NDArray[np.uint8] | None) -> State:
        states, poses = self._states_and_poses
        joints, touch, step = states[number].copy()
        return State(
            int(step), joints, touch, None if poses is None else poses[number].copy(), image
        )

    def _load_state(self, name: str) -> ControllerState:
        with self._guard():
            if name not in self._file:
                return {}
            group = self._file[name]
            for number in group:
                check_dataset(group, number, None, None)
            check_sizes(group, group)
            return load_state(group) if len(group) else {}

    def _check_open(self) -> None:
        file = self.__dict__.get("_file")
        if file is not None and not file:
            raise RecordingError(
                f"{self.path} is closed: use it inside `with Recording(...)`, or open it again"
            )

    @contextmanager
    def _guard(self) -> Iterator[None]:
        """Turn whatever h5py raises for a bad or closed file into one clear error."""
        self._check_open()
        try:
            yield
        except FileNotFoundError as error:
            raise RecordingError(f"recording not found: {self.path}") from error
        except IsADirectoryError as error:
            raise RecordingError(f"{self.path} is a folder, not a recording") from error
        except (OSError, LookupError, ValueError, RuntimeError, TypeError, MemoryError) as error:
            reason = one_line(error)
            raise RecordingError(
                f"{self.path} cannot be read: damaged, or not a recording ({reason})"
            ) from error
