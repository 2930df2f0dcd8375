from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from real_bench.errors import RealBenchError
from real_bench.real_x.change import ChangePredictor, changed
from real_bench.real_x.triplets import Triplets

NUMBERS = st.floats(-1e3, 1e3)


@given(arrays(np.float64, (6, 2), elements=NUMBERS), arrays(np.float64, (6, 2), elements=NUMBERS))
def test_a_change_is_more_than_a_hundredth_of_the_largest(
    states: NDArray[np.float64], outcomes: NDArray[np.float64]
) -> None:
    far = [float(np.linalg.norm(s - o)) for s, o in zip(states, outcomes, strict=True)]
    expected = [distance > 0.01 * max(far) for distance in far]
    assert changed(Triplets(states, outcomes)).tolist() == expected


def test_identical_states_have_not_changed() -> None:
    states = np.ones((3, 2))
    assert not changed(Triplets(states, states)).any()
    assert changed(Triplets(states[:0], states[:0])).shape == (0,)


def pushes(
    n: int, k: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Places of a thing, ways of a hand in k moments, and whether it came near the thing."""
    random = np.random.default_rng(seed)
    places, hands = random.uniform(0, 1, (n, 2)), random.uniform(0, 1, (n, k, 2))
    near = np.linalg.norm(hands - places[:, None], axis=2).min(axis=1) < 0.2
    return places, hands, near


@pytest.mark.parametrize("moments", [1, 6])
def test_predictor_learns_which_actions_hit(moments: int) -> None:
    predictor = ChangePredictor(seed=0)
    predictor.train(*pushes(3000, moments, 0))
    places, hands, near = pushes(1000, moments, 1)
    predicted = predictor.predict(places, hands)
    assert (predicted == near).mean() > 0.9 > max(near.mean(), 1 - near.mean())


def test_same_seed_gives_the_same_whatever_the_order_of_moments() -> None:
    places, hands, near = pushes(200, 4, 0)
    predictions = []
    for seed in (3, 3):
        predictor = ChangePredictor(seed)
        predictor.train(places, hands, near)
        predictions.append(predictor.predict(places, hands))
    np.testing.assert_array_equal(predictions[0], predictions[1])
    np.testing.assert_array_equal(predictor.predict(places, hands[:, ::-1]), predictions[0])


def test_untrained_predicts_no_change_and_bad_shapes_are_refused() -> None:
    places, hands, near = pushes(5, 2, 0)
    predictor = ChangePredictor(seed=0)
    assert not predictor.predict(places, hands).any()
    with pytest.raises(RealBenchError, match="as many states"):
        predictor.train(places[1:], hands, near)
    for rows in (slice(0), slice(1, None)):
        with pytest.raises(RealBenchError, match="cannot learn from"):
            predictor.train(places[rows], hands[rows], near if rows.start else near[:0])


def test_constant_outcomes_are_predicted() -> None:
    places, hands, near = pushes(50, 1, 0)
    for always in (False, True):
        predictor = ChangePredictor(seed=0)
        predictor.train(places, hands, np.full(len(near), always))
        assert (predictor.predict(places, hands) == always).all()
