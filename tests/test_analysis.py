from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from scipy.stats import pearsonr, spearmanr

from real_bench import analysis
from real_bench.errors import RealBenchError
from real_bench.real_x import DynamicAbstraction, Triplets
from real_bench.scoring.result import Result
from tests.scoring.bench import made

LENGTHS = st.floats(0, 1)


def moved(n_objects: int = 2) -> st.SearchStrategy[NDArray[np.float64]]:
    rows = st.integers(0, 40)
    return rows.flatmap(lambda n: arrays(np.float64, (n, n_objects), elements=LENGTHS))


def test_pairs_of_a_scaled_real_space_correlate_fully() -> None:
    random = np.random.default_rng(0)
    positions = random.uniform(-0.5, 0.5, (50, 2, 3))
    pairs = analysis.pair_distances(positions.reshape(50, 6) * 3, positions, 500, random)
    np.testing.assert_allclose(pairs.latent, 3 * pairs.real)
    assert pairs.spearman == pytest.approx(1)
    assert pairs.pearson == pytest.approx(1)


@given(arrays(np.float64, (2, 30), elements=st.floats(0, 1, width=16), unique=True))
def test_correlations_match_scipy(both: NDArray[np.float64]) -> None:
    pairs = analysis.PairDistances(*both)
    assert pairs.spearman == pytest.approx(spearmanr(*both).statistic)
    assert pairs.pearson == pytest.approx(pearsonr(*both).statistic)


def test_constant_values_have_no_correlation() -> None:
    alike = analysis.PairDistances(np.ones(3), np.arange(3.0))
    assert np.isnan([alike.spearman, alike.pearson]).all()
    nothing = alike.within(5, 6)
    assert np.isnan([nothing.spearman, nothing.pearson]).all()


def test_near_pairs_are_those_in_the_range() -> None:
    pairs = analysis.PairDistances(np.arange(4.0), np.array([0.005, 0.05, 0.19, 0.5]))
    assert pairs.within(*analysis.NEAR_M).latent.tolist() == [1, 2]


@given(st.integers(2, 5), st.integers(0, 100))
def test_no_state_is_paired_with_itself(n: int, seed: int) -> None:
    """Which would make any codes follow distances."""
    places = np.arange(n, dtype=np.float64)
    pairs = analysis.pair_distances(
        places[:, None], places[:, None, None], 50, np.random.default_rng(seed)
    )
    assert (pairs.real > 0).all()


def test_pairs_need_two_states_and_their_positions() -> None:
    random = np.random.default_rng(0)
    for n_states, n_positions in ((1, 1), (3, 2)):
        with pytest.raises(RealBenchError, match="at least 2 states"):
            analysis.pair_distances(
                np.zeros((n_states, 7)), np.zeros((n_positions, 1, 3)), 5, random
            )
    with pytest.raises(RealBenchError, match="as many latent as real"):
        analysis.PairDistances(np.zeros(2), np.zeros(3))


@given(moved())
def test_length_is_that_of_the_object_that_moved_farthest(
    displacements: NDArray[np.float64],
) -> None:
    lengths = analysis.action_lengths(displacements)
    farthest = [max(row) for row in displacements.tolist()]
    assert lengths.tolist() == sorted(far for far in farthest if far > 0.01)


@given(moved(), st.integers(1, 50))
def test_every_move_is_counted_in_one_period(
    displacements: NDArray[np.float64], period: int
) -> None:
    counts = analysis.moves_by_period(displacements, period)
    assert len(counts) == -(-len(displacements) // period)
    for number, count in enumerate(counts):
        rows = displacements[number * period : (number + 1) * period]
        assert count == (rows.max(axis=1) > 0.01).sum()


def test_empty_period_is_refused() -> None:
    with pytest.raises(RealBenchError, match="at least 1 action, not 0"):
        analysis.moves_by_period(np.zeros((3, 1)), 0)


@given(arrays(np.float64, (2, 20, 2), elements=st.floats(-1, 1, width=16)))
def test_effective_actions_are_counted_as_defined(both: NDArray[np.float64]) -> None:
    triplets = Triplets(*both)
    abstraction = DynamicAbstraction.learn(triplets, n_levels=6)
    counted = analysis.effective_actions(triplets, abstraction)
    for thresholds, count in zip(abstraction.thresholds, counted, strict=True):
        assert count == (triplets.differences > thresholds).any(axis=1).sum()


@given(arrays(np.float64, (6, 2), elements=st.floats(0, 0.05)), st.floats(0, 0.05))
def test_levels_below_a_length_come_first(differences: NDArray[np.float64], length: float) -> None:
    triplets = Triplets(np.zeros_like(differences), differences)
    abstraction = DynamicAbstraction.learn(triplets, n_levels=9)
    for count, thresholds in zip(
        analysis.levels_below(abstraction, length), abstraction.thresholds.T, strict=True
    ):
        assert (thresholds[:count] < length).all()
        assert (thresholds[count:] >= length).all()


def test_planar_triplets_are_x_and_y_of_each_object() -> None:
    positions = np.arange(18.0).reshape(3, 2, 3)
    triplets = analysis.planar(positions, np.array([0, 2]), np.array([1, 1]))
    assert triplets.states.tolist() == [[0, 1, 3, 4], [12, 13, 15, 16]]
    assert triplets.outcomes.tolist() == [[6, 7, 9, 10]] * 2


PLACES = arrays(
    np.float64, st.tuples(st.integers(0, 30), st.just(2)), elements=st.floats(-0.3, 0.5)
)


@given(PLACES)
def test_every_state_is_covered_once(positions: NDArray[np.float64]) -> None:
    low, high = (-0.25, -0.45), (0.25, 0.45)
    covered = analysis.coverage(positions, low, high)
    assert covered.counts.shape == (20 + 8, 36 + 8)
    inside = ((positions >= -0.35) & (positions <= 0.35)).all(axis=1)
    near = (positions[:, 0] <= 0.35) & (positions[:, 1] <= 0.55)
    assert covered.counts.sum() == near.sum() >= inside.sum()


def test_share_visited_counts_the_cells_of_a_region() -> None:
    low, high = (0.0, 0.0), (0.05, 0.1)  # 2 x 4 cells
    covered = analysis.coverage(np.array([[0.01, 0.01], [0.01, 0.02], [0.03, 0.09]]), low, high)
    assert covered.share_visited(low, high) == 2 / 8
    assert covered.share_visited(low, (0.025, 0.1)) == 1 / 4
    outside = analysis.coverage(np.array([[-0.01, 0.05], [7.0, 7.0]]), low, high)
    assert outside.counts.sum() == 1
    assert outside.share_visited(low, high) == 0


def result(distances: tuple[float, ...], run_steps: int = 0, **changes: Any) -> Result:
    return made(distances, classes=["2D"], run_steps=run_steps, **changes)


def test_scores_by_goal_and_by_length_are_means() -> None:
    """10 cm away scores 1/4, 5 cm 1/2."""
    short, long = result((0.1, 0.0), 1000), result((0.05, 0.05), 5000)
    other = result((0.0, 0.0), 5000, seed=1)
    classes, scores = analysis.scores_by_goal([long, other])
    assert classes == ("2D", "2D")
    np.testing.assert_allclose(scores, [0.75, 0.75])
    lengths, means = analysis.score_by_length([other, short, long])
    assert lengths.tolist() == [1000, 5000]
    np.testing.assert_allclose(means, [0.625, 0.75])
    with pytest.raises(RealBenchError, match="same goals"):
        analysis.scores_by_goal([short, result((0.2,))])


def test_a_play_that_is_tested_twice_counts_once() -> None:
    once = result((0.1, 0.1), run_sha256="a" * 64)
    twice = [result((0.0, 0.0), seed=seed, run_sha256="b" * 64) for seed in (1, 2)]
    np.testing.assert_allclose(analysis.scores_by_goal([once, *twice])[1], [0.625, 0.625])


def test_a_copy_of_a_result_counts_for_no_second_play() -> None:
    with pytest.raises(RealBenchError, match="two results are of the same test"):
        analysis.scores_by_goal([result((0.1, 0.1)), result((0.1, 0.1))])
