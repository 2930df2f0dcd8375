"""Whole numbers from users, of whatever type: as ints, or refused with their range."""

from __future__ import annotations

import operator
from contextlib import suppress
from numbers import Integral, Real
from typing import Any

from real_bench.errors import RealBenchError
from real_bench.inputs.numeric import short
from real_bench.lengths import LARGEST


def whole(
    value: Any,
    what: str,
    least: int = 0,
    most: int | None = None,
    error: type[RealBenchError] = RealBenchError,
) -> int:
    """The value as an int: numpy's ints and floats without a fraction, such as 15e6, are some.

    Args:
        value: what was given.
        what: its name, for the message.
        least: the smallest that may be.
        most: the largest that may be; None: any.
        error: raised if it is something else.
    """
    number = None
    is_float = isinstance(value, Real) and not isinstance(value, Integral)  # numpy's are, too
    if not isinstance(value, bool):
        with suppress(TypeError, ValueError, OverflowError):  # NaN and infinity are no number
            whole_part = int(value) if is_float else operator.index(value)
            number = whole_part if whole_part == value else None
    if number is None or not least <= number or (most is not None and number > most):
        given = value if number is not None or is_float else short(value)
        raise error(f"{what} must be a whole number {_range(least, most)}, not {given}")
    return number


def keep_whole(
    record: object,
    name: str,
    least: int = 0,
    most: int | None = None,
    error: type[RealBenchError] = RealBenchError,
) -> None:
    """Check an attribute of a frozen record, and keep it as an int; see :func:`whole`."""
    what = name.removeprefix("n_").replace("_", " ")
    object.__setattr__(record, name, whole(getattr(record, name), what, least, most, error))


def _range(least: int, most: int | None) -> str:
    if most is None:
        return f"of at least {least}"
    return f"from {least} to {'2**63 - 1' if most == LARGEST else f'{most:,}'}"
