from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from real_bench.text.quoting import MAX_LENGTH, quoted
from real_bench.verification.differences import Difference, numbers_differ, poses_differ

NUMBERS = st.floats(-5, 5)


@given(st.lists(NUMBERS, min_size=1), st.data())
def test_one_bit_is_a_difference(numbers: list[float], data: st.DataObject) -> None:
    assert list(numbers_differ("them", numbers, numbers)) == []
    others = np.array(numbers)
    index = data.draw(st.integers(0, len(numbers) - 1))
    others[index] = np.nextafter(others[index], 9)
    (found,) = numbers_differ("them", numbers, others)
    assert found.by == pytest.approx(abs(others[index] - numbers[index]), rel=1e-9)


def test_the_sign_of_zero_is_a_bit() -> None:
    assert len(list(numbers_differ("it", 0.0, -0.0))) == 1


def test_poses_differ_by_metres_and_by_the_worst_component() -> None:
    a = np.array([[0, 0, 0, 0, 0, 0, 1.0], [1, 1, 1, 0, 0, 0, 1.0]])
    b = a.copy()
    b[0, :2] = [0.3, 0.4]
    b[1, 3:5] = [0.1, -0.2]
    found = list(poses_differ(a, b, ("cube", "can")))
    assert [(each.what, each.unit) for each in found] == [
        ("position of cube", "m"),
        ("quaternion of can", ""),
    ]
    assert [each.by for each in found] == pytest.approx([0.5, 0.2])
    assert [str(each) for each in found] == [
        "position of cube differs by 0.5 m",
        "quaternion of can differs by 0.2",
    ]


def test_difference_without_a_number_is_its_text() -> None:
    assert str(Difference("it is blue")) == "it is blue"


@settings(max_examples=30)
@given(st.text())
def test_quoted_text_is_one_short_line(text: str) -> None:
    line = quoted(text)
    assert line.isprintable()
    assert len(line) <= MAX_LENGTH
