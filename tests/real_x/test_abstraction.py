from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from real_bench.errors import RealBenchError
from real_bench.real_x import N_LEVELS, DynamicAbstraction, Triplets

TENTHS = st.integers(0, 6).map(lambda number: number * 0.1)
NUMBERS = st.sampled_from([TENTHS, st.floats(-1e6, 1e6), st.sampled_from([0.0, -0.0, 1e-9, 1e6])])


def matrices(draw: st.DrawFn, n_rows: int, n_variables: int) -> NDArray[np.float64]:
    numbers = draw(NUMBERS)
    return draw(arrays(np.float64, (n_rows, n_variables), elements=numbers, fill=st.nothing()))


@st.composite
def experiences(draw: st.DrawFn, smallest: int = 1) -> Triplets:
    shape = draw(st.integers(smallest, 12)), draw(st.integers(1, 3))
    return Triplets(matrices(draw, *shape), matrices(draw, *shape))


@st.composite
def abstractions_and_differences(
    draw: st.DrawFn,
) -> tuple[DynamicAbstraction, NDArray[np.float64]]:
    """Differences among which many are exactly a threshold."""
    n_levels, n_variables = draw(st.integers(1, 6)), draw(st.integers(1, 3))
    thresholds = np.sort(np.abs(matrices(draw, n_levels, n_variables)), axis=0)
    others = np.abs(matrices(draw, draw(st.integers(0, 4)), n_variables))
    columns = np.vstack([thresholds, others]).T
    mixed = [draw(st.permutations(column.tolist())) for column in columns]
    return DynamicAbstraction(thresholds), np.array(mixed).T


@settings(max_examples=100)
@given(experiences(), st.integers(2, 30))
def test_thresholds_are_ranked_differences(triplets: Triplets, n_levels: int) -> None:
    thresholds = DynamicAbstraction.learn(triplets, n_levels).thresholds
    differences = np.abs(triplets.states - triplets.outcomes)
    assert thresholds.shape == (n_levels, triplets.n_variables)
    np.testing.assert_array_equal(thresholds, np.sort(thresholds, axis=0))
    np.testing.assert_array_equal(thresholds[0], differences.min(axis=0))
    np.testing.assert_array_equal(thresholds[-1], differences.max(axis=0))
    for column, of_variable in zip(thresholds.T, differences.T, strict=True):
        assert set(column.tolist()) <= set(of_variable.tolist())


@pytest.mark.parametrize(
    ("n_levels", "first", "second"),
    [
        (2, [1, 16], [0, 7]),
        (3, [1, 4, 16], [0, 3, 7]),
        (4, [1, 2, 8, 16], [0, 0, 5, 7]),
        (5, [1, 2, 4, 8, 16], [0, 0, 3, 5, 7]),
        (9, [1, 1, 2, 2, 4, 8, 8, 16, 16], [0, 0, 0, 0, 3, 5, 5, 7, 7]),
    ],
)
def test_thresholds_match_a_hand_calculation(
    n_levels: int, first: list[float], second: list[float]
) -> None:
    """Five triplets: level l of L takes rank 5 l // (L - 1) from 0, the last one rank 4."""
    states = np.array([[0, 0], [0, 5], [0, 1], [0, 0], [0, -2]])
    outcomes = np.array([[8, 7], [-1, 0], [16, 1], [2, -3], [-4, -2]])
    thresholds = DynamicAbstraction.learn(Triplets(states, outcomes), n_levels).thresholds
    np.testing.assert_array_equal(thresholds, np.array([first, second]).T)


def test_number_of_levels_defaults_to_that_of_the_paper() -> None:
    triplets = Triplets(np.zeros((3, 2)), np.ones((3, 2)))
    assert DynamicAbstraction.learn(triplets).n_levels == N_LEVELS == 200


@settings(max_examples=50)
@given(experiences(), st.randoms(use_true_random=False))
def test_the_order_of_the_triplets_does_not_matter(triplets: Triplets, random: object) -> None:
    order = list(range(len(triplets)))
    random.shuffle(order)  # type: ignore[attr-defined]
    shuffled = Triplets(triplets.states[order], triplets.outcomes[order])
    one, other = (DynamicAbstraction.learn(each, 7).thresholds for each in (triplets, shuffled))
    np.testing.assert_array_equal(one, other)


@settings(max_examples=100)
@given(abstractions_and_differences())
def test_levels_of_sameness_and_effect_match_the_definitions(
    case: tuple[DynamicAbstraction, NDArray[np.float64]],
) -> None:
    abstraction, differences = case
    first_same_level = abstraction.first_same_level(differences)
    effective_below = abstraction.effective_below(differences)
    assert first_same_level.shape == effective_below.shape == (len(differences),)
    for level, thresholds in enumerate(abstraction.thresholds):
        same = (differences < thresholds).all(axis=1)
        effective = (differences > thresholds).any(axis=1)
        np.testing.assert_array_equal(first_same_level <= level, same)
        np.testing.assert_array_equal(effective_below > level, effective)
    assert ((first_same_level >= 0) & (first_same_level <= abstraction.n_levels)).all()
    assert ((effective_below >= 0) & (effective_below <= abstraction.n_levels)).all()


def test_sameness_and_effect_match_a_hand_calculation() -> None:
    abstraction = DynamicAbstraction(np.array([[0.0, 1.0], [0.5, 1.0], [1.0, 2.0]]))
    differences = np.array([[0.0, 0.0], [0.5, 0.0], [0.25, 1.0], [1.0, 0.0], [0.0, 9.0]])
    assert abstraction.first_same_level(differences).tolist() == [1, 2, 2, 3, 3]
    assert abstraction.effective_below(differences).tolist() == [0, 1, 1, 2, 3]


@settings(max_examples=50)
@given(experiences())
def test_no_action_is_effective_at_the_last_level(
    triplets: Triplets,
) -> None:
    """The coarsest thresholds are the largest differences, and effects must exceed them."""
    abstraction = DynamicAbstraction.learn(triplets, 5)
    assert (abstraction.effective_below(triplets.differences) <= 4).all()


@pytest.mark.parametrize("n_variables", [1, 2, 14])
def test_nothing_is_the_same_without_triplets(n_variables: int) -> None:
    nothing = Triplets(np.empty((0, n_variables)), np.empty((0, n_variables)))
    assert len(nothing) == 0
    abstraction = DynamicAbstraction.learn(nothing, 3)
    assert (abstraction.n_levels, abstraction.n_variables) == (3, n_variables)
    assert abstraction.first_same_level(np.zeros((2, n_variables))).tolist() == [3, 3]
    assert abstraction.first_same_level(nothing.differences).shape == (0,)
    assert abstraction.effective_below(nothing.differences).shape == (0,)


def test_fixed_thresholds_make_one_level() -> None:
    abstraction = DynamicAbstraction.fixed([0.02, 0.04])
    assert (abstraction.n_levels, abstraction.n_variables) == (1, 2)
    assert abstraction.first_same_level(np.array([[0.01, 0.03], [0.02, 0.03]])).tolist() == [0, 1]


@pytest.mark.parametrize(
    ("thresholds", "complaint"),
    [
        ([[0.1], [-0.1]], "not negative"),
        ([[-1e-300]], "not negative"),
        ([[0.1, np.nan]], "finite"),
        ([[0.1], [np.inf]], "finite"),
        ([[0.1, 0.2], [0.2, 0.1]], "must not fall"),
        ([0.1, 0.2], r"levels x variables, not \(2,\)"),
        ([[[0.1]]], r"levels x variables, not \(1, 1, 1\)"),
        (0.1, "levels x variables"),
        (np.empty((0, 2)), "levels x variables"),
        (np.empty((2, 0)), "levels x variables"),
    ],
)
def test_invalid_thresholds_are_refused(thresholds: Any, complaint: str) -> None:
    with pytest.raises(RealBenchError, match=complaint):
        DynamicAbstraction(thresholds)


@pytest.mark.parametrize("thresholds", [[], [-0.1], [np.nan, 0.1]])
def test_invalid_fixed_thresholds_are_refused(thresholds: list[float]) -> None:
    with pytest.raises(RealBenchError, match="thresholds must be"):
        DynamicAbstraction.fixed(thresholds)


@pytest.mark.parametrize("n_levels", [1, 0, -3])
@pytest.mark.parametrize("n_triplets", [0, 3])
def test_fewer_than_two_levels_are_refused(n_levels: int, n_triplets: int) -> None:
    triplets = Triplets(np.zeros((n_triplets, 2)), np.ones((n_triplets, 2)))
    with pytest.raises(RealBenchError, match=f"at least 2 levels, not {n_levels}"):
        DynamicAbstraction.learn(triplets, n_levels)


@pytest.mark.parametrize(
    ("states", "outcomes"),
    [
        (np.zeros((3, 2)), np.zeros((3, 1))),
        (np.zeros((3, 2)), np.zeros((2, 2))),
        (np.zeros(3), np.zeros(3)),
        (np.zeros((1, 2, 2)), np.zeros((1, 2, 2))),
    ],
)
def test_triplets_of_unequal_shapes_are_refused(states: Any, outcomes: Any) -> None:
    with pytest.raises(RealBenchError, match="of one shape"):
        Triplets(states, outcomes)


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["states", "outcomes"])
def test_non_finite_triplets_are_counted_and_refused(name: str, number: float) -> None:
    fields = {"states": np.zeros((5, 2)), "outcomes": np.zeros((5, 2))}
    fields[name][2, 1] = fields[name][2, 0] = fields[name][4, 0] = number
    with pytest.raises(RealBenchError, match=r"2 of 5 triplets .* the first is triplet 2"):
        Triplets(**fields)
