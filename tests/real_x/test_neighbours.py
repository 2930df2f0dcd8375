from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from real_bench.real_x.neighbours import Neighbours

Vector = NDArray[np.float64]

GRID = st.integers(-4, 4).map(lambda number: number * 0.1)
FLOATS = st.floats(-1, 1).filter(lambda number: number == 0 or abs(number) > 1e-200)
SCALES = st.sampled_from([1e-9, 1e-3, 1.0, 1e3, 1e6])


def by_comparing_all(states: Vector, nodes: list[int], near: Vector, state: Vector) -> list[int]:
    return [
        node
        for node in nodes
        if all(abs(a - b) < most for a, b, most in zip(states[node], state, near, strict=True))
    ]


@st.composite
def crowds(draw: st.DrawFn) -> tuple[Vector, NDArray[np.int64], Vector, Vector]:
    """States, some of them to be found, thresholds, and a state to begin from.

    Each variable has a scale of its own; thresholds have theirs, or are an exact difference.
    """
    n, n_variables = draw(st.integers(1, 12)), draw(st.integers(1, 3))
    numbers = draw(st.sampled_from([GRID, FLOATS]))

    def rows(k: int) -> Vector:
        return draw(arrays(np.float64, (k, n_variables), elements=numbers, fill=st.nothing()))

    scales = np.array([draw(SCALES) for _ in range(n_variables)])
    states = rows(n) * scales
    state = states[draw(st.integers(0, n - 1))] if draw(st.booleans()) else rows(1)[0] * scales
    near = np.abs(rows(1)[0]) * draw(st.sampled_from([1.0, 1e-6, 1e6, 1.5])) * scales
    if draw(st.booleans()):  # what is exactly as far away as the threshold is not the same
        near = np.abs(states[draw(st.integers(0, n - 1))] - state)
    if draw(st.booleans()):
        near = np.where(near > 0, np.nextafter(near, np.inf), 0.0)
    nodes = [node for node in range(n) if draw(st.integers(0, 4))]
    return states, np.array(nodes, np.int64), near, state


@settings(max_examples=200)
@given(crowds())
def test_neighbours_match_a_brute_force_search(
    crowd: tuple[Vector, NDArray[np.int64], Vector, Vector],
) -> None:
    states, nodes, near, state = crowd
    found = Neighbours(states, nodes, near).find(state)
    assert sorted(found.tolist()) == by_comparing_all(states, nodes.tolist(), near, state)


@pytest.mark.parametrize("scale", [1e-9, 0.1, 1.0, 1e6])
@pytest.mark.parametrize("offset", [0.0, 1.0, 1e6])
def test_neighbours_at_the_threshold_match_brute_force(scale: float, offset: float) -> None:
    """Far from zero, rounding is larger than the differences that matter."""
    random = np.random.default_rng(0)
    for n_variables in (1, 2, 14):
        states = offset + random.integers(-3, 4, (200, n_variables)) * np.float64(scale)
        nodes = np.flatnonzero(random.random(200) < 0.8)
        for edges in (1, 2, 4):
            near = np.full(n_variables, edges * scale)
            neighbours = Neighbours(states, nodes, near)
            for state in states[::20]:
                expected = by_comparing_all(states, nodes.tolist(), near, state)
                assert sorted(neighbours.find(state).tolist()) == expected


@pytest.mark.parametrize("thresholds", [[0.0, 1.0], [0.0, 0.0]])
def test_nothing_is_found_where_a_threshold_is_zero(thresholds: list[float]) -> None:
    states = np.zeros((3, 2))
    neighbours = Neighbours(states, np.arange(3), np.array(thresholds))
    assert neighbours.find(states[0]).tolist() == []


def test_nothing_is_found_among_no_nodes() -> None:
    for states in (np.empty((0, 2)), np.zeros((3, 2))):
        neighbours = Neighbours(states, np.arange(0), np.ones(2))
        assert neighbours.find(np.zeros(2)).tolist() == []


def test_only_given_nodes_are_found() -> None:
    states = np.array([[0.5], [0.4], [0.3], [0.2], [0.1], [9.0]])
    neighbours = Neighbours(states, np.array([1, 2, 4, 5]), np.array([0.45]))
    assert sorted(neighbours.find(np.array([0.0])).tolist()) == [1, 2, 4]


@pytest.mark.filterwarnings("ignore:overflow")
def test_tiny_thresholds_find_identical_states() -> None:
    states = np.array([[0.0], [1.0], [1.0]])
    neighbours = Neighbours(states, np.arange(3), np.array([5e-324]))
    assert sorted(neighbours.find(states[1]).tolist()) == [1, 2]
