"""The header of a .npy file, read without trusting it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np

from real_bench.errors import GoalSetError

_READERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


@dataclass(frozen=True)
class NpyHeader:
    """What a .npy file declares."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]


def read_npy_header(stream: BinaryIO) -> NpyHeader:
    """Read the header; the stream is left where the data begins.

    Raises:
        GoalSetError: it is not the header of a .npy file.
    """
    try:
        version = np.lib.format.read_magic(stream)
        shape, _, dtype = _READERS[version](stream)
    except Exception as error:
        # numpy evaluates a literal and builds a dtype from it: a malicious one may raise nearly
        # anything (SyntaxError, RecursionError, MemoryError, TokenError, TypeError, ...).
        raise GoalSetError(f"it is not a .npy file ({_short(error)})") from error
    return NpyHeader(shape, dtype)


def _short(error: Exception) -> str:
    text = re.sub(r"\s+", " ", str(error)).strip()
    return text[:100] or type(error).__name__
