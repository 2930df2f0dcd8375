from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import check_grad
from threadpoolctl import threadpool_info, threadpool_limits

from real_bench.errors import RealBenchError
from real_bench.real_g.hand_eye import Contingencies, HandEye, _Problem, resample_path

Array = NDArray[np.float64]

LOW, HIGH = np.array([-0.25, -0.5]), np.array([0.05, 0.5])


def world(
    n: int, turn: float, mirror: bool, seed: int, chance: bool = False
) -> tuple[Contingencies, Array]:
    """Things near which the hand passes are pushed to its end; with a camera that looks askew."""
    random = np.random.default_rng(seed)
    c, s = np.cos(turn), np.sin(turn)
    linear = 0.006 * np.array([[c, s], [-s, c]]) @ np.diag([1.0, -1.1 if mirror else 1.1])
    xy = random.uniform(LOW, HIGH, (n, 2))
    ends = random.uniform(LOW, HIGH, (n, 2, 2))
    paths = np.array([resample_path(path) for path in ends])
    way = ends[:, 1] - ends[:, 0]
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    moved = np.linalg.norm(paths - xy[:, None], axis=2).min(axis=1) < 0.06
    if chance:
        moved = random.random(n) < 0.2
    late = random.random(n)[:, None] < 0.5  # half of them are lost on the way
    after = np.where(late, xy + 0.3 * (ends[:, 1] - xy), ends[:, 1] + 0.05 * way)
    after = np.where(moved[:, None], after + random.normal(0, 0.01, (n, 2)), xy)
    inverse = np.linalg.inv(linear)
    offset = random.uniform(LOW, HIGH)
    return Contingencies((xy - offset) @ inverse, (after - offset) @ inverse, paths, moved), xy


@settings(max_examples=6)
@given(turn=st.floats(0, 2 * np.pi), mirror=st.booleans(), seed=st.integers(0, 1000))
def test_camera_map_is_found_for_any_orientation(turn: float, mirror: bool, seed: int) -> None:
    seen, xy = world(400, turn, mirror, seed)
    hand_eye = HandEye(LOW, HIGH)
    assert hand_eye.fit(seen, np.random.default_rng(0))
    errors = np.linalg.norm(hand_eye.xy(seen.before) - xy, axis=1)
    assert np.median(errors) < 0.02
    assert hand_eye.scale == pytest.approx(0.0063, rel=0.1)


@pytest.mark.parametrize("seed", range(5))
def test_nothing_is_learned_from_chance(seed: int) -> None:
    seen, _ = world(300, 1.0, False, seed, chance=True)
    random = np.random.default_rng(seed)
    shuffled = Contingencies(
        seen.before, seen.before[random.permutation(300)], seen.paths, seen.moved
    )
    hand_eye = HandEye(LOW, HIGH)
    assert not hand_eye.fit(shuffled, random)
    assert np.isnan(hand_eye.xy(seen.before)).all()


def test_a_fit_uses_one_thread_of_blas(monkeypatch: pytest.MonkeyPatch) -> None:
    """With two, waiting for one another on small matrices took four times as long."""
    found: list[set[int]] = []
    cost = _Problem.cost

    def noting(self: _Problem, parameters: np.ndarray) -> tuple[float, np.ndarray]:
        if not found:
            found.append(blas_threads())
        return cost(self, parameters)

    monkeypatch.setattr(_Problem, "cost", noting)
    with threadpool_limits(limits=2, user_api="blas"):
        before = blas_threads()
        HandEye(LOW, HIGH).fit(world(100, 1.0, False, 0)[0], np.random.default_rng(0))
        assert found == [{1}]
        assert blas_threads() == before


def blas_threads() -> set[int]:
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_gradient_matches_the_cost() -> None:
    seen, _ = world(200, 0.4, True, 3)
    heights = np.random.default_rng(0).uniform(0.4, 0.6, (200, 24, 1))
    seen = Contingencies(
        seen.before, seen.after, np.concatenate([seen.paths, heights], axis=2), seen.moved
    )
    problem = _Problem(seen, (LOW + HIGH) / 2, 0.5)
    start = problem._start(np.array([[0.1, 0.2], [0.5, 0.3], [-0.2, 0.6]]))

    def cost(parameters: Array) -> float:
        return problem.cost(parameters)[0]

    def gradient(parameters: Array) -> Array:
        return problem.cost(parameters)[1]

    error = check_grad(cost, gradient, start)
    assert error < 1e-3 * np.linalg.norm(problem.cost(start)[1])


def test_map_that_no_longer_fits_is_given_up() -> None:
    hand_eye = HandEye(LOW, HIGH)
    assert hand_eye.fit(world(400, 0.5, False, 1)[0], np.random.default_rng(0))
    chance, _ = world(400, 0.5, False, 2, chance=True)
    shuffled = Contingencies(chance.before, chance.before[::-1].copy(), chance.paths, chance.moved)
    assert not hand_eye.fit(shuffled, np.random.default_rng(0))


def test_state_restores_the_map() -> None:
    seen, _ = world(400, 0.5, False, 1)
    hand_eye, heir = HandEye(LOW, HIGH), HandEye(LOW, HIGH)
    heir.set_state(hand_eye.get_state())
    assert not heir.is_known
    hand_eye.fit(seen, np.random.default_rng(0))
    heir.set_state(hand_eye.get_state())
    np.testing.assert_array_equal(heir.xy(seen.before), hand_eye.xy(seen.before))


@given(n=st.integers(2, 40), seed=st.integers(0, 99))
def test_points_along_a_path_begin_and_end_with_it(n: int, seed: int) -> None:
    corners = np.random.default_rng(seed).uniform(-1, 1, (4, 3))
    points = resample_path(corners, n)
    assert points.shape == (n, 3)
    np.testing.assert_allclose(points[[0, -1]], corners[[0, -1]])


def test_contingencies_of_unequal_length_are_refused() -> None:
    with pytest.raises(RealBenchError, match="contingencies need"):
        Contingencies(np.zeros((3, 2)), np.zeros((2, 2)), np.zeros((3, 5, 2)), np.zeros(3, bool))
