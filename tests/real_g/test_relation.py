from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from real_bench.real_g.hand import Primitive
from real_bench.real_g.relation import Relation, orientation_features, rotate
from tests.real_g.deeds import DEEDS, HAND, drawn, rows


@pytest.mark.parametrize("deed", DEEDS)
@given(seed=st.integers(0, 1000))
def test_end_can_be_recovered_from_its_outcome(deed: Primitive, seed: int) -> None:
    relation, numbers = Relation(deed), drawn(deed, 5, seed)
    before, after = rows(5, seed), rows(5, seed + 1)
    outcome = relation.outcome(before, after, numbers)
    np.testing.assert_allclose(
        relation.end_positions(before, outcome, numbers), after[:, :3], atol=1e-12
    )
    several = np.stack([outcome, outcome], axis=1)
    ends = relation.end_positions(before, several, numbers)
    np.testing.assert_allclose(ends[:, 1], after[:, :3], atol=1e-12)


@pytest.mark.parametrize("deed", DEEDS)
@given(seed=st.integers(0, 1000))
def test_outcome_is_zero_when_following_and_whole_when_staying(deed: Primitive, seed: int) -> None:
    relation, numbers, before = Relation(deed), drawn(deed, 5, seed), rows(5, seed)
    followed = before.copy()
    followed[:, :2] += relation.displacement(numbers)
    np.testing.assert_allclose(relation.outcome(before, followed, numbers), 0, atol=1e-12)
    np.testing.assert_allclose(relation.contingency(before, followed, numbers), 1)
    np.testing.assert_allclose(
        relation.outcome(before, before, numbers), relation.static_outcome(numbers), atol=1e-12
    )
    np.testing.assert_allclose(relation.contingency(before, before, numbers), 0, atol=1e-12)


@given(seed=st.integers(0, 1000), share=st.floats(0, 1))
def test_contingency_grows_with_the_distance_followed(seed: int, share: float) -> None:
    relation, numbers, before = Relation(HAND), drawn(HAND, 1, seed), rows(1, seed)
    part, whole = before.copy(), before.copy()
    part[:, :2] += share * relation.displacement(numbers)
    whole[:, :2] += relation.displacement(numbers)
    assert 0 <= relation.contingency(before, part, numbers) <= 1
    assert relation.contingency(before, part, numbers) <= relation.contingency(
        before, whole, numbers
    )


@given(seed=st.integers(0, 1000), angle=st.floats(-3, 3))
def test_orientation_is_relative_to_the_hand(seed: int, angle: float) -> None:
    quaternion = rows(1, seed)[:, 3:]
    half = angle / 2
    x, y, z, w = quaternion[0]
    s, c = np.sin(half), np.cos(half)
    around = np.array([[c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z]])
    at = np.array([0.3])
    np.testing.assert_allclose(
        orientation_features(around, at + angle), orientation_features(quaternion, at), atol=1e-9
    )
    np.testing.assert_allclose(
        orientation_features(quaternion, at + np.pi),
        orientation_features(quaternion, at),
        atol=1e-9,
    )


@given(angle=st.floats(-3, 3))
def test_quarter_turn_shows_only_in_the_double_angle(angle: float) -> None:
    def lying(turn: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        return np.array([[0, 0, np.sin(turn / 2), np.cos(turn / 2)]])

    at = np.zeros(1)
    here, there = (
        orientation_features(lying(angle), at),
        orientation_features(lying(angle + np.pi / 2), at),
    )
    np.testing.assert_allclose(here[:, -2:], there[:, -2:], atol=1e-9)
    np.testing.assert_allclose(here[:, 0], -there[:, 0], atol=1e-9)


@pytest.mark.parametrize("deed", DEEDS)
def test_features_are_finite_and_use_orientation_where_seen(deed: Primitive) -> None:
    relation, numbers, before = Relation(deed), drawn(deed, 4), rows(4)
    with_it = relation.features(before, numbers)
    without = relation.features(before[:, :3], numbers)
    assert np.isfinite(with_it).all()
    np.testing.assert_array_equal(with_it[:, : without.shape[1]], without)
    assert with_it.shape[1] == without.shape[1] + 11


@given(st.floats(-10, 10), st.floats(-1, 1), st.floats(-1, 1))
def test_turning_back_undoes_turning(angle: float, x: float, y: float) -> None:
    vector, by = np.array([[x, y]]), np.array([angle])
    np.testing.assert_allclose(rotate(rotate(vector, by), -by), vector, atol=1e-12)
