"""Goal sets as files: one structured numpy array, one row per goal.

``np.load(path, allow_pickle=False)`` opens one anywhere. Images are PNGs in fields of fixed size,
padded with zeros. What holds for the whole set is repeated in every row, and every row carries a
hash, so rows may be taken out (``np.save(out, rows[:10])``) but not altered.
"""

from __future__ import annotations

import hashlib
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import GoalSetError
from real_bench.files.atomic import write_atomically
from real_bench.goal_sets.goal import NO_BODY, Goal, GoalSet, check_size
from real_bench.goal_sets.npy import read_npy_header
from real_bench.goal_sets.png import decode_png, encode_png, read_png_header
from real_bench.inputs.numeric import short

FORMAT = "realbench-goals"
VERSION = 1
IMAGE_FIELDS = ("retina_before_png", "retina_png", "mask_png")
MAX_FILE_BYTES = 2**30
NO_BODY_IN_PNG = 255

_Rows = NDArray[np.void]


def save_goal_set(goal_set: GoalSet, path: str | Path, *, is_secret: bool = False) -> None:
    """Write a goal set; the same set always gives the same bytes.

    Args:
        goal_set: the goals.
        path: the file.
        is_secret: let nobody else read it.

    Raises:
        OutputError: the file cannot be written.
    """
    images = [_encoded_images(goal) for goal in goal_set.goals]
    sizes = [max(map(len, column)) for column in zip(*images, strict=True)]
    rows = np.zeros(len(goal_set), _row_dtype(goal_set.n_objects, sizes))
    for field, value in _whole_set_fields(goal_set).items():
        rows[field] = value
    for row, goal, pngs in zip(rows, goal_set.goals, images, strict=True):
        row["challenge"] = goal.challenge
        row["initial_poses"] = goal.initial_poses
        row["final_poses"] = goal.final_poses
        row["row_sha256"] = _row_sha256(goal_set, goal)
        for field, png in zip(IMAGE_FIELDS, pngs, strict=True):
            row[field] = np.void(png.ljust(rows.dtype[field].itemsize, b"\0"))
    stream = io.BytesIO()
    np.save(stream, rows, allow_pickle=False)
    write_atomically(Path(path), stream.getvalue(), is_secret=is_secret)


def as_goal_set(goals: GoalSet | str | Path) -> GoalSet:
    """A goal set, or the one in a file; raises GoalSetError if it is neither."""
    if isinstance(goals, str | Path):
        return load_goal_set(goals)
    if not isinstance(goals, GoalSet):
        raise GoalSetError(f"goals must be a GoalSet or its file, not {short(goals)}")
    return goals


def load_goal_set(path: str | Path) -> GoalSet:
    """Read a goal set that :func:`save_goal_set` wrote.

    Raises:
        GoalSetError: the file cannot be read, is something else, or has been damaged or altered.
    """
    try:
        return _goal_set(_read_rows(Path(path)))
    except OSError as error:
        raise GoalSetError(f"cannot read {path}: {error.strerror or error}") from error
    except GoalSetError as error:
        raise GoalSetError(f"{path} cannot be used as a goal set: {error}") from error


def _row_dtype(n_objects: int, image_bytes: list[int]) -> np.dtype[np.void]:
    fields: list[Any] = [
        ("format", "<U16"),
        ("version", "<i4"),
        ("scene", "<U32"),
        ("scene_sha256", "<U64"),
        ("generator", "<U32"),
        ("seed", "<i8"),
        ("objects", "<U32", (n_objects,)),
        ("challenge", "<U4"),
        ("initial_poses", "<f8", (n_objects, 7)),
        ("final_poses", "<f8", (n_objects, 7)),
        *((field, f"V{size}") for field, size in zip(IMAGE_FIELDS, image_bytes, strict=True)),
        ("row_sha256", "<U64"),
    ]
    return np.dtype(fields)


def _whole_set_fields(goal_set: GoalSet) -> dict[str, object]:
    return {"format": FORMAT, "version": VERSION, **goal_set.facts}


def _row_sha256(goal_set: GoalSet, goal: Goal) -> str:
    content = json.dumps({**_whole_set_fields(goal_set), "goal": goal.sha256}, sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()


def _encoded_images(goal: Goal) -> tuple[bytes, bytes, bytes]:
    mask = np.where(goal.mask == NO_BODY, NO_BODY_IN_PNG, goal.mask).astype(np.uint8)
    return encode_png(goal.retina_before), encode_png(goal.retina), encode_png(mask)


def _read_rows(path: Path) -> _Rows:
    """The rows, after the header is found to fit the file's size and our format."""
    if path.suffix == ".npz":
        raise GoalSetError("this is an .npz: convert official goals with `realbench goals import`")
    n_bytes = path.stat().st_size
    if n_bytes > MAX_FILE_BYTES:
        raise GoalSetError(f"it has {n_bytes} bytes, at most {MAX_FILE_BYTES} are read")
    with path.open("rb") as stream:
        header = read_npy_header(stream)
        if header.dtype.hasobject:
            raise GoalSetError("it holds pickled Python objects, which could run code: refused")
        if len(header.shape) != 1 or header.shape[0] < 1:
            raise GoalSetError(f"it holds an array of shape {header.shape}, not rows")
        declared = header.shape[0] * header.dtype.itemsize
        if declared != n_bytes - stream.tell():
            raise GoalSetError(
                f"it declares {declared} bytes but holds {n_bytes - stream.tell()}: "
                "it was cut short or altered"
            )
        _check_rows_have_format(header.dtype)
        rows: _Rows = np.frombuffer(stream.read(declared), header.dtype)
    _check_format(rows)
    return rows


def _check_rows_have_format(dtype: np.dtype[Any]) -> None:
    ours = _row_dtype(1, [1] * len(IMAGE_FIELDS))
    for field in ("format", "version"):
        if dtype.names is None or field not in dtype.names or dtype[field] != ours[field]:
            raise GoalSetError(f"its rows have no field {field!r}")


def _check_format(rows: _Rows) -> None:
    if (rows["format"] != FORMAT).any():
        raise GoalSetError(f"its format is not {FORMAT!r}")
    if (rows["version"] != VERSION).any():
        raise GoalSetError(
            f"it has version {rows['version'].max()}, this realbench reads {VERSION}: "
            "use the realbench that wrote it"
        )
    names = rows.dtype.names or ()
    objects_shape = rows.dtype["objects"].shape if "objects" in names else ()
    sizes = [rows.dtype[field].itemsize for field in IMAGE_FIELDS if field in names]
    fits = len(objects_shape) == 1 and len(sizes) == len(IMAGE_FIELDS)
    if not fits or rows.dtype != _row_dtype(objects_shape[0], sizes):
        raise GoalSetError(f"its fields are not those of version {VERSION}")


def _goal_set(rows: _Rows) -> GoalSet:
    _check_images(rows)
    first = rows[0]
    goals = tuple(_goal(index, row) for index, row in enumerate(rows))
    goal_set = GoalSet(
        goals=goals,
        object_names=tuple(map(str, first["objects"])),
        scene=str(first["scene"]),
        scene_sha256=str(first["scene_sha256"]),
        generator=str(first["generator"]),
        seed=int(first["seed"]),
    )
    _check_unaltered(goal_set, rows)
    return goal_set


def _check_images(rows: _Rows) -> None:
    """Check that all images have one size and fit in memory, before any is decoded."""
    headers = {read_png_header(bytes(row[field])) for row in rows for field in IMAGE_FIELDS}
    sizes = {(header.height, header.width) for header in headers}
    if len(sizes) != 1:
        raise GoalSetError(f"its images have different sizes: {sorted(sizes)}")
    check_size(len(rows), *sizes.pop())


def _goal(index: int, row: np.void) -> Goal:
    try:
        mask = decode_png(bytes(row["mask_png"])).astype(np.int32)
        return Goal(
            challenge=str(row["challenge"]),
            initial_poses=row["initial_poses"],
            final_poses=row["final_poses"],
            retina_before=decode_png(bytes(row["retina_before_png"])),
            retina=decode_png(bytes(row["retina_png"])),
            mask=np.where(mask == NO_BODY_IN_PNG, NO_BODY, mask),
        )
    except GoalSetError as error:
        raise GoalSetError(f"goal {index}: {error}") from error


def _check_unaltered(goal_set: GoalSet, rows: _Rows) -> None:
    for index, (row, goal) in enumerate(zip(rows, goal_set.goals, strict=True)):
        for field, value in _whole_set_fields(goal_set).items():
            if (row[field] != value).any() if field == "objects" else row[field] != value:
                raise GoalSetError(f"goal {index} has another {field} than goal 0")
        if row["row_sha256"] != _row_sha256(goal_set, goal):
            raise GoalSetError(f"goal {index} does not match its hash: it was altered")
