"""Whole numbers from users: as ints, whatever type they come in, or an error with their range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from real_bench.errors import RealBenchError, ResultError
from real_bench.inputs.whole import keep_whole, whole
from real_bench.lengths import LARGEST

SMALL = st.integers(-(2**31), 2**31 - 1)


@given(SMALL, st.sampled_from([int, float, np.int32, np.int64, np.float64]))
def test_whole_numbers_of_any_type_become_ints(number: int, kind: type) -> None:
    kept = whole(kind(number), "it", -(2**31))
    assert type(kept) is int
    assert kept == number


@given(SMALL, SMALL, SMALL)
def test_numbers_outside_their_range_are_refused(number: int, one: int, other: int) -> None:
    least, most = sorted([one, other])
    if least <= number <= most:
        assert whole(number, "it", least, most) == number
        return
    with pytest.raises(RealBenchError, match=rf"^it must be a whole number from .*, not {number}$"):
        whole(number, "it", least, most)


@given(
    st.floats().filter(lambda value: not value.is_integer())
    | st.text()
    | st.none()
    | st.booleans()
    | st.lists(st.integers())
)
def test_everything_else_is_refused_in_one_line(value: object) -> None:
    with pytest.raises(ResultError, match=r"^jobs must be a whole number of at least 1, not .*$"):
        whole(value, "jobs", 1, error=ResultError)


def test_records_keep_ints_and_name_what_is_wrong() -> None:
    @dataclass(frozen=True)
    class Part:
        n_run_steps: int

        def __post_init__(self) -> None:
            keep_whole(self, "n_run_steps", 1, LARGEST)

    assert type(Part(15e6).n_run_steps) is int  # type: ignore[arg-type]
    with pytest.raises(RealBenchError, match=r"^run steps must .* from 1 to 2\*\*63 - 1, not 0$"):
        Part(0)


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.float64, np.int8, np.uint64])
def test_numpy_numbers_are_whole_if_they_are(kind: type[np.number[Any]]) -> None:
    assert whole(kind(64), "steps") == 64


@pytest.mark.parametrize(
    "value", [np.float32(0.5), np.float32("nan"), np.float64("inf"), np.bool_(1)]
)
def test_numpy_numbers_that_are_not_whole_are_refused(value: Any) -> None:
    with pytest.raises(RealBenchError, match="steps must be a whole number"):
        whole(value, "steps")
