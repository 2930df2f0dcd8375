from __future__ import annotations

import numpy as np

from real_bench.real_g.ground import Ground

NEAR, FAR = 1 - 1 / 7.0, 1 - 1 / 9.0


def test_objects_that_moved_away_are_not_ground() -> None:
    ground = Ground()
    for column in (40, 200):
        depth = np.full((240, 320), FAR)
        depth[100:120, column : column + 20] = NEAR
        ground.add(depth)
    places = np.array([[50.0, 110.0], [210.0, 110.0], [5.0, 5.0]])
    np.testing.assert_allclose(ground.distance(places), 9.0, rtol=1e-5)


def test_nearest_ground_counts_where_there_is_no_depth() -> None:
    depth = np.full((240, 320), 1.0)
    depth[:, :100], depth[:, 100:200] = NEAR, FAR
    ground = Ground()
    ground.add(depth)
    places = np.array([[[50.0, 60.0], [150.0, 60.0]], [[230.0, 60.0], [319.0, 239.0]]])
    np.testing.assert_allclose(ground.distance(places), [[7, 9], [9, 9]], rtol=1e-5)


def test_everything_is_equally_far_without_depth() -> None:
    assert Ground().distance(np.zeros((4, 2))).tolist() == [1, 1, 1, 1]
    nothing = Ground()
    nothing.add(np.ones((240, 320)))
    assert np.ptp(nothing.distance(np.array([[3.0, 4.0], [300.0, 200.0]]))) == 0


def test_state_restores_the_ground() -> None:
    ground, heir = Ground(), Ground()
    ground.add(np.linspace(0.8, 0.9, 240 * 320).reshape(240, 320))
    heir.set_state(ground.get_state())
    places = np.random.default_rng(0).uniform(0, 240, (30, 2))
    np.testing.assert_array_equal(ground.distance(places), heir.distance(places))
