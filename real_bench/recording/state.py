"""A controller's state in HDF5, without pickle.

The structure is one JSON text; arrays and bytes lie beside it as datasets, and the JSON refers to
them by number.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import count
from typing import Any

import h5py
import numpy as np

from real_bench.errors import StateError

ControllerState = dict[str, Any]
"""What a controller hands over: a dict from names to numbers, text, bytes, numpy arrays, or lists
and dicts of these. No pickle: a state can be read anywhere, and runs no code."""

_TREE = "structure"
_MARK = "__kept_as__"
_DATASET_BYTES = 512  # what a dataset takes besides its numbers
_WIDEST = {"b": 1, "i": 8, "u": 8, "f": 8, "c": 16}  # bytes by kind: what every machine has
_LARGE = 2**63  # beyond it, decimal text is slow to read and limited in length


def save_state(group: h5py.Group, state: ControllerState) -> None:
    """Write a state into an empty group; raises StateError for what cannot be stored."""
    tree, datasets = strip_state(state)
    group.create_dataset(_TREE, data=np.frombuffer(tree.encode(), np.uint8))
    for number, array in enumerate(datasets):
        group.create_dataset(str(number), data=array)


def load_state(group: h5py.Group) -> ControllerState:
    """Read what :func:`save_state` wrote; raises KeyError or ValueError if it is damaged."""
    return restore_state(group[_TREE][()].tobytes().decode(), lambda number: group[str(number)][()])


def check_state(state: ControllerState) -> None:
    """Raise StateError if a state cannot be stored."""
    strip_state(state)


def state_bytes(state: ControllerState) -> int:
    """About how much room a state takes in a file."""
    tree, datasets = strip_state(state)
    return len(tree) + sum(array.nbytes + _DATASET_BYTES for array in datasets)


def is_same_state(one: ControllerState, other: ControllerState) -> bool:
    """Whether two states are equal bit by bit; a NaN equals itself."""
    (structure, arrays), (again, others) = strip_state(one), strip_state(other)
    return structure == again and all(map(_is_same_array, arrays, others))


def _is_same_array(one: np.ndarray[Any, Any], other: np.ndarray[Any, Any]) -> bool:
    alike = one.dtype == other.dtype and one.shape == other.shape
    return alike and one.tobytes() == other.tobytes()


def strip_state(state: ControllerState) -> tuple[str, list[np.ndarray[Any, Any]]]:
    """The structure of a state as JSON, and the arrays that it refers to by number.

    Raises:
        StateError: it holds something that cannot be stored.
    """
    datasets: list[np.ndarray[Any, Any]] = []
    try:
        return json.dumps(_strip(state, datasets, "state")), datasets
    except RecursionError as error:
        raise StateError("a controller's state is nested too deeply, or contains itself") from error


def restore_state(structure: str, array: Callable[[int], Any]) -> ControllerState:
    """What :func:`strip_state` took apart; raises ValueError (or KeyError) where damaged.

    Args:
        structure: its first part.
        array: gives the array of a number; each is asked for once, as it is in the state.
    """
    left = count()

    def next_array(number: Any) -> Any:
        if type(number) is not int or number != next(left):
            raise ValueError(f"array {number!r} is not the next one")
        return array(number)

    state = _restore(json.loads(structure), next_array)
    if not isinstance(state, dict):
        raise ValueError("a controller's state must be a dict")
    return state


def _strip(value: Any, datasets: list[np.ndarray[Any, Any]], where: str) -> Any:
    """The JSON form of a value; its arrays and bytes go to ``datasets``."""
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, int):
        return value if abs(value) < _LARGE else {_MARK: "int", "value": hex(value)}
    if isinstance(value, float):
        number = float(value)
        return number if np.isfinite(number) else {_MARK: "float", "value": repr(number)}
    if isinstance(value, bytes):
        datasets.append(np.frombuffer(value, np.uint8))
        return {_MARK: "bytes", "number": len(datasets) - 1}
    if isinstance(value, np.ndarray | np.generic):
        return _strip_array(np.asarray(value), datasets, where)
    if (
        isinstance(value, dict)
        and all(isinstance(key, str) for key in value)
        and _MARK not in value
    ):
        return {key: _strip(item, datasets, f"{where}[{key!r}]") for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_strip(item, datasets, f"{where}[{i}]") for i, item in enumerate(value)]
    if isinstance(value, dict):
        wrong = next(key for key in value if not isinstance(key, str) or key == _MARK)
        why = "is reserved" if wrong == _MARK else "is not text"
        raise StateError(f"its {where} has the key {wrong!r}, which {why}")
    raise StateError(
        f"its {where} has type {type(value).__name__}: only numbers, text, bytes, "
        "numpy arrays, and lists and dicts (with text keys) of these can be stored"
        + (" (of a tensor: its .numpy())" if type(value).__name__ == "Tensor" else "")
    )


def _strip_array(array: np.ndarray[Any, Any], datasets: list[Any], where: str) -> dict[str, Any]:
    if array.dtype.itemsize > _WIDEST.get(array.dtype.kind, 0):
        raise StateError(
            f"its {where} is an array of {array.dtype}: only numbers of up to 64 bits can be stored"
        )
    datasets.append(array.copy())
    return {_MARK: "array", "number": len(datasets) - 1}


def _restore(tree: Any, array: Callable[[int], Any]) -> Any:
    if isinstance(tree, list):
        return [_restore(item, array) for item in tree]
    if not isinstance(tree, dict):
        return tree
    if _MARK not in tree:
        return {key: _restore(item, array) for key, item in tree.items()}
    if tree[_MARK] == "float":
        return float(tree["value"])
    if tree[_MARK] == "int":
        return int(tree["value"], 16)
    content = array(tree["number"])
    return content.tobytes() if tree[_MARK] == "bytes" else content
