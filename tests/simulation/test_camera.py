from __future__ import annotations

import numpy as np

from real_bench.simulation import Scene, Simulation


def test_points_project_to_where_the_camera_shows_them(builtin_scene: Scene) -> None:
    with Simulation(builtin_scene, 3) as simulation:
        simulation.hold([0.0] * 9, 300)
        mask, positions = simulation.image().mask, simulation.object_poses()[:, :3]
        found = simulation.camera.pixels(positions)
        bodies = sorted(set(np.unique(mask).tolist()) - {-1})[-3:]  # loaded last, in order
        for body, point in zip(bodies, found, strict=True):
            rows, columns = np.nonzero(mask == body)
            middle = columns.mean(), rows.mean()
            assert np.abs(point - middle).max() < 6  # seen from above and aside


def test_camera_target_projects_to_the_image_centre(builtin_scene: Scene) -> None:
    with Simulation(builtin_scene, 1) as simulation:
        height, width, _ = simulation.image().retina.shape
        spec = builtin_scene.manifest.camera
        (column, row), *_ = simulation.camera.pixels(np.array([spec.target]))
        assert (column, row) == (width / 2, height / 2) or np.allclose(
            (column, row), (width / 2, height / 2)
        )
