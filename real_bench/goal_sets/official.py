"""Goal files of the official package, real-robots 0.1.21: pickles, read without running them."""

from __future__ import annotations

import io
import math
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import GoalSetError
from real_bench.goal_sets.goal import CHALLENGES, UNKNOWN_SEED, Goal, GoalSet, check_size
from real_bench.goal_sets.inert_pickle import PickledCall, read_pickle
from real_bench.goal_sets.npy import read_npy_header
from real_bench.simulation.scene import Scene
from real_bench.text.counting import counted

GENERATOR = "real-robots-0.1.21"
MAX_BYTES = 2**28  # 50 official goals unpack to 38 MB

PICKLED_FROM = "real_robots.envs.env"
"""The module that pickles in such a file name."""

_GOAL = f"{PICKLED_FROM} Goal"
_DTYPE = "numpy dtype"
_RECONSTRUCT = frozenset(
    {"numpy.core.multiarray _reconstruct", "numpy._core.multiarray _reconstruct"}
)
_ALLOWED = _RECONSTRUCT | {_GOAL, _DTYPE, "numpy ndarray"}
_NUMBER_TYPES = frozenset({"f8", "f4", "i8", "i4", "i2", "i1", "u1"})
_BYTE_ORDERS = frozenset({"<", ">", "|", "="})


def import_official(path: str | Path, scene: Scene) -> GoalSet:
    """Read an official goal file, e.g. ``official-2-objects.npz``.

    Args:
        path: an .npz that holds one pickled array of the official package's goals.
        scene: the scene the goals belong to; it gives the order of the objects.

    Raises:
        GoalSetError: the file is something else, or asks for more than goals need.
    """
    try:
        pickled = _unzip(Path(path))
        goals = [_fields(goal) for goal in _object_array(pickled)]
        names = _object_names(goals, scene)
        return GoalSet(
            goals=_goals(goals, names),
            object_names=names,
            scene=scene.name,
            scene_sha256=scene.sha256,
            generator=GENERATOR,
            seed=UNKNOWN_SEED,
        )
    except OSError as error:
        raise GoalSetError(f"cannot read {path}: {error.strerror or error}") from error
    except GoalSetError as error:
        raise GoalSetError(f"{path} cannot be used as an official goal file: {error}") from error


def _unzip(path: Path) -> bytes:
    """The only member of the .npz, once its declared size is found to be modest."""
    if path.stat().st_size > MAX_BYTES:
        raise GoalSetError(f"it has {path.stat().st_size} bytes, at most {MAX_BYTES} are read")
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            if len(members) != 1 or not members[0].filename.endswith(".npy"):
                raise GoalSetError(f"it has {counted(len(members), 'member')}, not one .npy")
            if members[0].file_size > MAX_BYTES:
                raise GoalSetError(
                    f"it unpacks to {members[0].file_size} bytes, at most {MAX_BYTES} are read"
                )
            if members[0].compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise GoalSetError("it is compressed with a method that numpy does not use")
            return archive.read(members[0])
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError) as error:
        raise GoalSetError(f"its zip archive cannot be read ({error})") from error


def _object_array(content: bytes) -> list[Any]:
    """The entries of a .npy that holds one array of pickled objects."""
    stream = io.BytesIO(content)
    header = read_npy_header(stream)
    if not header.dtype.hasobject or len(header.shape) != 1:
        raise GoalSetError(f"it holds {header.dtype} of shape {header.shape}, not a row of goals")
    array = read_pickle(content[stream.tell() :], _ALLOWED)
    _, _, _, _, entries = _array_state(array)
    if not isinstance(entries, list) or not entries:
        raise GoalSetError("it holds no goals")
    return entries


def _fields(goal: Any) -> dict[str, Any]:
    if (
        not isinstance(goal, PickledCall)
        or goal.by.text != _GOAL
        or not isinstance(goal.state, dict)
    ):
        raise GoalSetError("it holds something other than goals")
    wanted = ("challenge", "initial_state", "final_state", "retina_before", "retina", "mask")
    missing = [name for name in wanted if name not in goal.state]
    if missing:
        raise GoalSetError(f"a goal has no {', '.join(missing)}")
    return goal.state


def _object_names(goals: list[dict[str, Any]], scene: Scene) -> tuple[str, ...]:
    """The scene's objects that every goal places, in the scene's order."""
    names = {
        frozenset(state) if isinstance(state := goal[which], dict) else frozenset()
        for goal in goals
        for which in ("initial_state", "final_state")
    }
    found = names.pop()
    available = tuple(body.name for body in scene.manifest.objects)
    if names or not found or found != set(available[: len(found)]):
        raise GoalSetError(
            f"its goals do not all place the first objects of scene {scene.name}, "
            f"which are {', '.join(available)}"
        )
    return available[: len(found)]


def _goals(goals: list[dict[str, Any]], names: tuple[str, ...]) -> tuple[Goal, ...]:
    height, width = _array(goals[0]["mask"], 2).shape
    check_size(len(goals), height, width)
    return tuple(_goal(index, goal, names) for index, goal in enumerate(goals))


def _goal(index: int, goal: dict[str, Any], names: tuple[str, ...]) -> Goal:
    try:
        return Goal(
            challenge=_challenge(goal["challenge"]),
            initial_poses=_poses(goal["initial_state"], names),
            final_poses=_poses(goal["final_state"], names),
            retina_before=_array(goal["retina_before"], 3),
            retina=_array(goal["retina"], 3),
            mask=_array(goal["mask"], 2),
        )
    except GoalSetError as error:
        raise GoalSetError(f"goal {index}: {error}") from error


def _challenge(value: Any) -> str:
    """``2D``, also where the file says ``2`` or ``2d``; the goal itself refuses the rest."""
    text = value[:8] if isinstance(value, str) else type(value).__name__
    named = f"{text.upper().removesuffix('D')}D"
    return named if named in CHALLENGES else text


def _poses(state: dict[str, Any], names: tuple[str, ...]) -> NDArray[np.float64]:
    poses = [_array(state[name], 1) for name in names]
    if any(len(pose) != 7 for pose in poses):
        raise GoalSetError(f"poses have {[len(pose) for pose in poses]} numbers, not 7")
    return np.array(poses, dtype=np.float64)


def _array(value: Any, n_dimensions: int) -> NDArray[Any]:
    """An array of numbers, its declared size checked against the bytes that are there."""
    _, shape, dtype, fortran, data = _array_state(value)
    number_type = _number_type(dtype)
    dimensions = isinstance(shape, tuple) and all(type(n) is int and n >= 0 for n in shape)
    if not dimensions or len(shape) != n_dimensions:
        raise GoalSetError(f"an array is not {n_dimensions}-dimensional")
    if not isinstance(data, bytes) or len(data) != math.prod(shape) * number_type.itemsize:
        raise GoalSetError("an array holds more or fewer bytes than it declares")
    return np.frombuffer(data, number_type).reshape(shape, order="F" if fortran is True else "C")


def _array_state(value: Any) -> tuple[Any, ...]:
    """The state that numpy would give an array: version, shape, dtype, Fortran order, data."""
    is_array = isinstance(value, PickledCall) and value.by.text in _RECONSTRUCT
    if not is_array or not isinstance(value.state, tuple) or len(value.state) != 5:
        raise GoalSetError("something other than an array where one was expected")
    return value.state


def _number_type(value: Any) -> np.dtype[Any]:
    is_dtype = isinstance(value, PickledCall) and value.by.text == _DTYPE and value.arguments
    code = value.arguments[0] if is_dtype else None
    state = value.state if is_dtype else None
    order = state[1] if isinstance(state, tuple) and len(state) > 1 else None
    known = isinstance(code, str) and code in _NUMBER_TYPES
    if not known or not isinstance(order, str) or order not in _BYTE_ORDERS:
        raise GoalSetError("an array does not hold plain numbers")
    return np.dtype(f"{order}{code}")
