from __future__ import annotations

import threading
from collections.abc import Callable
from copy import deepcopy
from datetime import date
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy

from real_bench.errors import StateError
from real_bench.recording.state import check_state, is_same_state, load_state, save_state

NUMBER_TYPES = (
    st_numpy.boolean_dtypes()
    | st_numpy.integer_dtypes(endianness="?")
    | st_numpy.unsigned_integer_dtypes(endianness="?")
    | st_numpy.floating_dtypes(endianness="?")
    | st_numpy.complex_number_dtypes()
)
ARRAYS = st_numpy.arrays(NUMBER_TYPES, st_numpy.array_shapes(min_dims=0, min_side=0, max_side=4))
LARGE_INTEGERS = st.builds(pow, st.just(-3), st.integers(0, 8000))  # of up to 3,800 digits
LEAVES = (
    st.none()
    | st.booleans()
    | st.integers()
    | LARGE_INTEGERS
    | st.floats()
    | st.text()
    | st.binary()
    | ARRAYS
)
KEYS = st.text().filter(lambda key: key != "__kept_as__")  # which is refused, see below
VALUES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=4)
)
STATES = st.dictionaries(KEYS, VALUES, max_size=5)


def through_file(state: dict[str, Any]) -> dict[str, Any]:
    with h5py.File("memory", "w", driver="core", backing_store=False) as file:
        save_state(file.create_group("state"), state)
        return load_state(file["state"])


def alike(one: Any, other: Any) -> bool:
    """Equal in type and value, NaN and the sign of zero included."""
    if isinstance(one, np.ndarray) and one.ndim == 0:  # comes back as a number of numpy
        one, other = one[()], np.asarray(other)[()]
    if isinstance(one, np.ndarray | np.generic):
        return (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
    if type(one) is not type(other):
        return False
    if isinstance(one, dict):
        return list(one) == list(other) and all(alike(one[key], other[key]) for key in one)
    if isinstance(one, list):
        return len(one) == len(other) and all(map(alike, one, other))
    return repr(one) == repr(other)


@settings(deadline=None)
@given(STATES, ARRAYS)
def test_a_state_is_the_same_as_itself_alone(state: dict[str, Any], array: np.ndarray) -> None:
    state = {**state, "nan": np.full(2, np.nan)}
    assert is_same_state(state, deepcopy(state))
    assert not is_same_state(state, {**state, "more": array})
    if array.size:
        other = np.frombuffer(bytes(255 - byte for byte in array.tobytes()), array.dtype)
        other = other.reshape(array.shape)
        if array.dtype != bool:  # whose bytes are 0 and 1
            assert not is_same_state({"a": array}, {"a": other})


@given(STATES)
def test_a_state_survives_its_file(state: dict[str, Any]) -> None:
    check_state(state)
    assert alike(state, through_file(state))


@pytest.mark.parametrize(
    "bits", [np.random.PCG64, np.random.MT19937, np.random.Philox, np.random.SFC64]
)
def test_numpy_generators_continue_where_they_were(
    bits: Callable[[int], np.random.BitGenerator],
) -> None:
    first, second = np.random.Generator(bits(5)), np.random.Generator(bits(6))
    first.normal(size=7)
    second.bit_generator.state = through_file({"random": first.bit_generator.state})["random"]
    assert first.normal(size=9).tolist() == second.normal(size=9).tolist()


@pytest.mark.parametrize("value", [np.float64("nan"), np.float64("inf"), np.float64("-inf")])
def test_non_finite_numpy_numbers_survive(value: np.float64) -> None:
    assert repr(float(through_file({"best": value})["best"])) == repr(float(value))


def test_an_integer_of_any_size_survives() -> None:
    assert through_file({"large": 10**5000}) == {"large": 10**5000}


@pytest.mark.parametrize(
    "value",
    [
        {1, 2},
        object(),
        1j,
        date(2020, 1, 1),
        bytearray(b"x"),
        {1: "a key that is not text"},
        {"__kept_as__": "array"},
        np.array(["text"]),
        np.array([None]),
        np.array("2020-01-01", "M8[D]"),
        np.zeros(2, [("x", "f4")]),
        threading.Lock(),
        print,
        np.zeros(2, np.longdouble),
    ],
    ids=lambda value: type(value).__name__,
)
@pytest.mark.parametrize("keep", [check_state, through_file])
def test_unsupported_values_are_refused_with_their_place(
    value: object, keep: Callable[[dict[str, Any]], object]
) -> None:
    with pytest.raises(StateError, match=r"state\['a'\]\[1\]"):
        keep({"a": [0, value]})


def test_a_state_that_holds_itself_is_refused() -> None:
    state: dict[str, Any] = {}
    state["self"] = state
    with pytest.raises(StateError):
        check_state(state)


@pytest.mark.parametrize(
    ("key", "why"), [(1, "1, which is not text"), ("__kept_as__", "'__kept_as__', which is reser")]
)
def test_a_key_that_cannot_be_stored_is_told(key: object, why: str) -> None:
    with pytest.raises(StateError, match=rf"state\['a'\] has the key {why}"):
        check_state({"a": {key: 2.0}})
