"""Numbers from others: accepted as numbers, or refused with a description."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import ActionError
from real_bench.text.quoting import one_line

MAX_MAGNITUDE = 1e6
"""No sensible command has more metres or radians."""


def finite(vector: NDArray[np.float64], what: str) -> NDArray[np.float64]:
    """The vector itself; raises ActionError unless all its numbers are finite and moderate."""
    if not (np.abs(vector) <= MAX_MAGNITUDE).all():
        raise ActionError(f"{what} must be finite numbers, not {vector.tolist()}")
    return vector


def numbers(value: object, what: str, size: int) -> NDArray[np.float64]:
    """``size`` numbers of any shape; raises ActionError."""
    try:
        given = np.array(value, np.float64)
    except Exception as error:  # a stranger's object may raise anything
        raise ActionError(
            f"{what} must be {size} numbers, not {short(value)}{_hint(value)}"
        ) from error
    if given.size != size:
        raise ActionError(f"{what} must be {size} numbers, not an array of shape {given.shape}")
    return given


def any_numbers(value: object, what: str) -> NDArray[np.float64]:
    """Numbers of any shape; raises ActionError."""
    try:
        return np.array(value, np.float64)
    except Exception as error:  # a stranger's object may raise anything
        raise ActionError(f"{what} must be numbers, not {short(value)}{_hint(value)}") from error


def _hint(value: object) -> str:
    return " (of a tensor: its .detach().numpy())" if type(value).__name__ == "Tensor" else ""


def short(value: object) -> str:
    """A short description of a value, for messages."""
    try:
        text = one_line(f"{type(value).__name__} {value!r}")
    except Exception:  # a stranger's object may raise anything
        return type(value).__name__
    return text if len(text) < 80 else text[:77] + "..."
