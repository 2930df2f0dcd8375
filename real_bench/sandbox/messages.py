"""Messages between two processes that need not trust each other: typed, checked, without pickle.

A message is plain data in msgpack; arrays are written as their kind and shape, and their numbers
follow in one block. So what a reader must build before it can check anything stays small: the
structure has its own limit, and numbers cost no more than their bytes.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import msgpack
import numpy as np
from numpy.typing import NDArray

from real_bench.errors import RealBenchError

_CODES = "? i1 u1 <i2 <u2 <i4 <u4 <i8 <u8 <f2 <f4 <f8 <c8 <c16"
ARRAY_KINDS = tuple(map(np.dtype, _CODES.split(" ")))
MAX_DIMENSIONS = 16
MAX_NESTING = 32
HEAD = struct.Struct("<IQ")  # bytes of the structure, bytes of the numbers

_ARRAY = 1  # msgpack's number for our only extension
_SIZES = struct.Struct("<BB")


class MessageError(RealBenchError):
    """A message that is not one of ours."""


@dataclass(frozen=True)
class Size:
    """How large a message may be.

    Attributes:
        structure: bytes of everything but arrays; each may take a hundred bytes in memory.
        numbers: bytes of all arrays together.
    """

    structure: int
    numbers: int


def encode(value: Any) -> bytes:
    """A message: None, bool, int (64 bits), float, text, arrays, and lists and dicts of these.

    Raises:
        MessageError: it holds something else.
    """
    blocks: list[bytes] = []

    def array(part: Any) -> Any:
        if isinstance(part, np.ndarray):
            return _describe(part, blocks)
        if type(part) is tuple:
            return list(part)
        raise MessageError(f"a message cannot hold {type(part).__name__}")

    try:
        structure = msgpack.packb(value, default=array, strict_types=True)
    except (OverflowError, ValueError, TypeError, RecursionError) as error:
        raise MessageError(f"a message cannot hold this: {error}") from error
    numbers = b"".join(blocks)
    return b"".join((HEAD.pack(len(structure), len(numbers)), structure, numbers))


def decode(structure: bytes, numbers: bytes | bytearray) -> Any:
    """The value of a message; arrays are fresh and own their numbers.

    Raises:
        MessageError: it is not what :func:`encode` makes.
    """
    place = 0

    def array(code: int, content: bytes) -> NDArray[Any]:
        nonlocal place
        if code != _ARRAY:
            raise MessageError(f"extension {code} is unknown")
        kind, shape, count = _parse_description(content)
        if count * kind.itemsize > len(numbers) - place:
            raise MessageError(f"an array of shape {shape} is larger than what was sent")
        raw = np.frombuffer(numbers, np.uint8 if kind == np.bool_ else kind, count, place)
        place += count * kind.itemsize
        # Through numbers, since a byte of 2 would be a bool that is neither true nor false.
        try:
            return raw.reshape(shape).astype(kind)
        except ValueError as error:  # a shape with a 0 may hold any numbers beside it
            raise MessageError(f"an array cannot have shape {shape}") from error

    try:
        value = msgpack.unpackb(structure, ext_hook=array, strict_map_key=True, raw=False)
    except MessageError:
        raise
    except Exception as error:  # msgpack has many ways to refuse what is malformed
        raise MessageError(f"it is malformed ({type(error).__name__})") from error
    if place != len(numbers):
        raise MessageError("it holds numbers that belong to no array")
    return value


def check_plain(value: Any, depth: int = MAX_NESTING) -> None:
    """Raise MessageError for what :func:`encode` would not send, or too deep nesting."""
    if isinstance(value, list | dict):
        if depth == 0:
            raise MessageError(f"it is nested more than {MAX_NESTING} levels deep")
        for part in value.values() if isinstance(value, dict) else value:
            check_plain(part, depth - 1)
    elif not (value is None or isinstance(value, bool | int | float | str | np.ndarray)):
        raise MessageError(f"it holds {type(value).__name__}")


def _describe(array: NDArray[Any], blocks: list[bytes]) -> msgpack.ExtType:
    blocks.append(array.astype(array.dtype.newbyteorder("<"), copy=False).tobytes())
    return _description(array.dtype.newbyteorder("<"), array.shape)


@lru_cache(1024)  # there are few kinds of arrays, and many of each
def _description(kind: np.dtype[Any], shape: tuple[int, ...]) -> msgpack.ExtType:
    if kind not in ARRAY_KINDS or len(shape) > MAX_DIMENSIONS:
        raise MessageError(f"a message cannot hold an array of {kind}, {len(shape)} dimensions")
    sizes = struct.pack(f"<{len(shape)}Q", *shape)
    return msgpack.ExtType(_ARRAY, _SIZES.pack(ARRAY_KINDS.index(kind), len(shape)) + sizes)


@lru_cache(1024)
def _parse_description(content: bytes) -> tuple[np.dtype[Any], tuple[int, ...], int]:
    """Kind, shape, and how many numbers that is."""
    if len(content) < _SIZES.size:
        raise MessageError("an array is not described")
    number, n_dimensions = _SIZES.unpack_from(content)
    if number >= len(ARRAY_KINDS) or n_dimensions > MAX_DIMENSIONS:
        raise MessageError(f"an array of kind {number}, {n_dimensions} dimensions is unknown")
    if len(content) != _SIZES.size + 8 * n_dimensions:
        raise MessageError("an array's shape is cut short")
    shape = struct.unpack_from(f"<{n_dimensions}Q", content, _SIZES.size)
    return ARRAY_KINDS[number], shape, math.prod(shape)
