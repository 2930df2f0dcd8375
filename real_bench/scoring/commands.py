"""The commands of a trial as they are kept in a result: compact, and exact to the last bit."""

from __future__ import annotations

import base64
import binascii
import hashlib
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from real_bench.actions import Action
from real_bench.errors import ActionError, ResultError
from real_bench.inputs.records import Record
from real_bench.lengths import MAX_TRIAL_STEPS

MAX_COMMAND_SIZE = 32
"""Numbers in a command vector."""


def row_type(size: int) -> np.dtype[Any]:
    """The row type of a command of ``size`` numbers; ``begins`` marks the first of an action."""
    fields = [("command", "<f8", (size,)), ("n_steps", "<i8"), ("line", "u1"), ("begins", "u1")]
    return np.dtype(fields)


class Commands(Record):
    """Whole actions as they were executed.

    Attributes:
        size: numbers in a command vector.
        rows: how many commands.
        data: the rows (:func:`row_type`), one after the other, zlib-compressed, as base64.

    Raises:
        ValueError: the data are not what is declared, or not commands.
    """

    size: int = Field(ge=1, le=MAX_COMMAND_SIZE)
    rows: int = Field(ge=1, le=MAX_TRIAL_STEPS)
    data: str = Field(repr=False)

    @model_validator(mode="after")
    def _data_are_commands(self) -> Commands:
        _action(self._unpack())  # all as one: what holds for each command holds for all
        return self

    @classmethod
    def of(cls, actions: Sequence[Action]) -> Commands:
        """The commands of actions, at least one; raises ResultError for too many."""
        rows = np.concatenate([_rows(action) for action in actions])
        if int(rows["n_steps"].sum()) > MAX_TRIAL_STEPS:
            raise ResultError(f"a trial of more than {MAX_TRIAL_STEPS:,} steps cannot be stored")
        data = base64.b64encode(zlib.compress(rows.tobytes())).decode()
        return cls(size=rows["command"].shape[1], rows=len(rows), data=data)

    @property
    def actions(self) -> list[Action]:
        """The actions, ready to be executed again."""
        return [_action(part) for part in _split(self._unpack())]

    @property
    def sha256(self) -> str:
        """A hash of every command, its duration and its action."""
        digest = hashlib.sha256()
        for rows in _split(self._unpack()):
            for name in ("command", "n_steps", "line"):
                digest.update(rows[name].tobytes())
        return digest.hexdigest()

    @property
    def n_steps(self) -> int:
        """How long all of them last."""
        return int(self._unpack()["n_steps"].sum())

    @property
    def n_actions(self) -> int:
        """How many actions command anything; rests do not."""
        rows = self._unpack()
        commanded = ~np.isnan(rows["command"]).all(axis=1)
        number = np.cumsum(rows["begins"], dtype=np.int64)
        return len(np.unique(number[commanded]))

    def _unpack(self) -> NDArray[Any]:
        """The rows, checked; never unpacks more bytes than are declared."""
        kind = row_type(self.size)
        content = _decompress(self.data, self.rows * kind.itemsize)
        rows = np.frombuffer(content, kind)
        missing = np.isnan(rows["command"])
        durations = rows["n_steps"]
        if (missing.any(axis=1) != missing.all(axis=1)).any():
            raise ValueError("a command must be all numbers or all NaN")
        if not ((durations >= 1) & (durations <= MAX_TRIAL_STEPS)).all():
            raise ValueError(f"a command lasts 1 to {MAX_TRIAL_STEPS} steps")
        if int(durations.sum()) > MAX_TRIAL_STEPS:
            raise ValueError(f"commands last more than {MAX_TRIAL_STEPS} steps together")
        if rows["begins"][0] != 1 or max(rows["begins"].max(), rows["line"].max()) > 1:
            raise ValueError("commands do not mark where actions begin")
        return rows


def largest_length(size: int, n_steps: int) -> int:
    """The most characters for commands of ``size`` numbers, if each step has one of its own."""
    return 4 * row_type(size).itemsize * n_steps // 3


def _split(rows: NDArray[Any]) -> list[NDArray[Any]]:
    """The rows of each action."""
    return np.split(rows, np.flatnonzero(rows["begins"])[1:])


def _action(rows: NDArray[Any]) -> Action:
    try:
        return Action.from_rows(rows)
    except ActionError as error:
        raise ValueError(str(error)) from error


def _rows(action: Action) -> NDArray[Any]:
    rows = np.zeros(len(action.commands), row_type(action.commands.shape[1]))
    rows["command"], rows["n_steps"], rows["line"] = action.commands, action.n_steps, action.line
    rows["begins"][0] = 1
    return rows


def _decompress(data: str, n_bytes: int) -> bytes:
    try:
        compressed = base64.b64decode(data, validate=True)
        stream = zlib.decompressobj()
        content = stream.decompress(compressed, n_bytes + 1)
    except (binascii.Error, ValueError, zlib.error) as error:
        raise ValueError(f"commands cannot be unpacked: {error}") from error
    if base64.b64encode(compressed).decode() != data or stream.unused_data:
        raise ValueError("commands cannot be unpacked: there is extra data")
    if len(content) != n_bytes or not stream.eof:
        raise ValueError(f"commands do not unpack to the {n_bytes} bytes that are declared")
    return content
