"""The scene `builtin`: its bodies weigh, move, touch and look as they should."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pybullet
import pytest

from real_bench.controls.macro import MACRO_EULER, plan_macro
from real_bench.simulation import HOME, Scene, Simulation

ROBOT, TABLE, CUBE, TOMATO, MUSTARD = range(5)  # body ids follow the load order
TABLE_TOP, SHELF_TOP = 0.2805, 0.3815
REST_ABOVE_TOP = (0.04, 0.0532, 0.042)  # of the centres of cube, standing can, lying bottle

# body -> mass, lateral friction, restitution, rolling friction, spinning friction
DYNAMICS = {
    TABLE: (0.0, 1.0, 0.01, 0.0, 0.0),
    CUBE: (1.5, 0.5, 0.1, 1e-4, 1e-4),
    TOMATO: (3.0, 0.5, 0.01, 1e-3, 1e-3),
    MUSTARD: (2.0, 0.5, 0.1, 1e-2, 1e-2),
}
LINK_MASSES = (4, 4, 3, 2.7, 1.7, 1.8, 0.3, 2, 2, 2, 0, 0, 2, 2, 0, 0)

# nine joint angles -> position and quaternion of the end effector and of one skin,
# computed once from the official robot
KINEMATICS = [
    (
        (0.3, -0.5, 0.7, 1.1, -0.4, 0.9, 1.3, 0.6, 0.8),
        (-1.02446, -0.43918, 0.82488, -0.01774, -0.29712, 0.84666, 0.44111),
        (-1.02753, -0.52455, 0.90071, -0.11971, -0.24374, 0.8717, 0.40793),
    ),
    (
        (-1.0, 0.8, 0.2, -1.2, 1.5, -0.7, -2.0, 1.2, 0.4),
        (-0.12916, -0.63749, 0.40453, 0.36205, 0.74038, -0.50464, 0.25711),
        (-0.05646, -0.73416, 0.46825, 0.17777, 0.57066, -0.56713, 0.56666),
    ),
]
END_EFFECTOR, SKIN_11 = 7, 14


@pytest.mark.parametrize("n_objects", [1, 2, 3])
def test_objects_settle_below_their_start_and_stay(builtin_scene: Scene, n_objects: int) -> None:
    starts = np.array([body.position for body in builtin_scene.manifest.objects[:n_objects]])
    with Simulation(builtin_scene, n_objects) as simulation:
        simulation.hold(HOME, 200)
        settled = simulation.object_poses()
        simulation.hold(HOME, 1000)
        later = simulation.object_poses()
    assert np.abs(settled[:, :2] - starts[:, :2]).max() < 0.01
    assert settled[:, 2] == pytest.approx(
        TABLE_TOP + np.array(REST_ABOVE_TOP[:n_objects]), abs=0.001
    )
    assert np.abs(later[:, :3] - settled[:, :3]).max() < 0.001


@pytest.mark.parametrize("thing", [0, 1, 2])
def test_the_shelf_holds_an_object(builtin_scene: Scene, thing: int) -> None:
    with Simulation(builtin_scene, 3) as simulation:
        poses = simulation.object_poses()
        poses[thing, :3] = (0.18, 0.05, 0.5)
        simulation.reset(poses)
        simulation.hold(HOME, 400)
        position = simulation.object_poses()[thing, :3]
        assert simulation.n_put_back == 0
    assert position[:2] == pytest.approx((0.18, 0.05), abs=0.01)
    assert position[2] == pytest.approx(SHELF_TOP + REST_ABOVE_TOP[thing], abs=0.0015)


@pytest.mark.parametrize(
    ("macro", "lowest", "highest"),
    [
        ((-0.1, -0.15, -0.1, 0.05), 0.05, 0.2),  # across the cube
        ((-0.2, -0.45, 0.0, -0.25), 0.0, 0.001),  # far from it
    ],
)
def test_a_macro_moves_the_cube_only_where_it_passes(
    builtin_scene: Scene, macro: tuple[float, ...], lowest: float, highest: float
) -> None:
    with Simulation(builtin_scene) as simulation:
        simulation.hold(HOME, 200)
        before = simulation.object_poses()[0]
        simulation.follow(plan_macro(macro, simulation))
        after = simulation.object_poses()[0]
        assert simulation.n_put_back == 0
    assert lowest <= after[1] - before[1] < highest
    assert after[2] == pytest.approx(before[2], abs=0.002)


def test_the_gripper_passes_low_over_the_table_without_touching_it(builtin_scene: Scene) -> None:
    with Simulation(builtin_scene) as simulation:
        *_, (ready, n_ready), _ = segments = plan_macro((-0.2, 0.3, -0.2, 0.3), simulation)
        simulation.follow(segments[:4])
        near = pybullet.getClosestPoints(ROBOT, TABLE, 0.05, physicsClientId=simulation.client)
        assert 0.025 < min(point[8] for point in near) < 0.04
        simulation.hold(ready, n_ready)
        simulation.hold(HOME, 300)
        assert not pybullet.getContactPoints(ROBOT, physicsClientId=simulation.client)
        apart = pybullet.getClosestPoints(ROBOT, TABLE, 1, physicsClientId=simulation.client)
        assert min(point[8] for point in apart) > 0.1


def test_touch_sensors_feel_what_the_gripper_squeezes(builtin_scene: Scene) -> None:
    quaternion = pybullet.getQuaternionFromEuler(MACRO_EULER)
    with Simulation(builtin_scene) as simulation:
        simulation.hold(HOME, 200)
        assert not simulation.touch_sensors().any()
        x, y = simulation.object_poses()[0, :2]
        for height in (0.6, 0.43):
            arm = simulation.robot.inverse_kinematics((x, y, height), quaternion)[:7]
            simulation.hold((*arm, 0.9, 0.9), 300)
        assert not simulation.touch_sensors().any()
        felt = np.zeros(4)
        for angle in np.arange(0.8, 0.3, -0.05):
            simulation.hold((*arm, angle, angle), 20)
            felt = np.maximum(felt, simulation.touch_sensors())
    skin_00, skin_01, skin_10, skin_11 = felt
    assert min(skin_01, skin_11) > 50  # newtons, at both finger tips
    assert skin_00 == skin_10 == 0


def test_image_shows_every_body_in_a_distinct_colour(builtin_scene: Scene) -> None:
    with Simulation(builtin_scene, 3) as simulation:
        simulation.hold(HOME, 200)
        image = simulation.image()
    assert set(np.unique(image.mask)) == {-1, ROBOT, TABLE, CUBE, TOMATO, MUSTARD}
    bodies = (TABLE, CUBE, TOMATO, MUSTARD)
    assert all(np.count_nonzero(image.mask == body) > 100 for body in bodies)
    colours = [image.retina[image.mask == body].mean(axis=0) for body in bodies]
    for one, other in combinations(colours, 2):
        assert np.linalg.norm(one - other) > 50
    centres = [np.argwhere(image.mask == body).mean(axis=0) for body in bodies[1:]]
    assert centres[1][1] < centres[0][1] < centres[2][1]  # can, cube, bottle from left to right


def test_masses_and_frictions_match_the_official_scene(builtin_scene: Scene) -> None:
    with Simulation(builtin_scene, 3) as simulation:
        for body, expected in DYNAMICS.items():
            info = pybullet.getDynamicsInfo(body, -1, simulation.client)
            assert (info[0], info[1], *info[5:8]) == pytest.approx(expected)
        shelf = pybullet.getDynamicsInfo(TABLE, 0, simulation.client)
        assert (shelf[1], shelf[5]) == pytest.approx((1.0, 0.01))
        masses = [
            pybullet.getDynamicsInfo(ROBOT, link, simulation.client)[0]
            for link in range(pybullet.getNumJoints(ROBOT, simulation.client))
        ]
    assert masses == pytest.approx(LINK_MASSES)


@pytest.mark.parametrize(("angles", "end_effector", "skin_11"), KINEMATICS)
def test_arm_kinematics_match_the_official_arm(
    builtin_scene: Scene,
    angles: tuple[float, ...],
    end_effector: tuple[float, ...],
    skin_11: tuple[float, ...],
) -> None:
    with Simulation(builtin_scene) as simulation:
        simulation.robot.set_joint_positions(np.array(angles))
        for link, expected in ((END_EFFECTOR, end_effector), (SKIN_11, skin_11)):
            state = pybullet.getLinkState(
                ROBOT, link, computeForwardKinematics=True, physicsClientId=simulation.client
            )
            assert (*state[4], *state[5]) == pytest.approx(expected, abs=2e-5)


def test_robot_matches_the_official_one_except_its_shapes(
    builtin_scene: Scene, official_scene: Scene
) -> None:
    with Simulation(builtin_scene) as ours, Simulation(official_scene) as theirs:
        n_joints = pybullet.getNumJoints(ROBOT, theirs.client)
        assert pybullet.getNumJoints(ROBOT, ours.client) == n_joints
        for joint in range(n_joints):
            mine = pybullet.getJointInfo(ROBOT, joint, ours.client)
            other = pybullet.getJointInfo(ROBOT, joint, theirs.client)
            assert (*mine[:6], mine[12], mine[16]) == (*other[:6], other[12], other[16])
            assert np.hstack([*mine[6:12], *mine[13:16]]) == pytest.approx(
                np.hstack([*other[6:12], *other[13:16]])
            )
            mine = pybullet.getDynamicsInfo(ROBOT, joint, ours.client)
            other = pybullet.getDynamicsInfo(ROBOT, joint, theirs.client)
            assert mine[2] == pytest.approx(other[2], rel=0.03)  # inertia, from the shapes
            assert (mine[0], mine[1], *mine[5:8]) == pytest.approx(
                (other[0], other[1], *other[5:8])
            )


def test_manifest_matches_the_official_one_except_its_files(
    builtin_scene: Scene, official_scene: Scene
) -> None:
    ours, theirs = (
        scene.manifest.model_dump(exclude={"name": True, "assets": True})
        for scene in (builtin_scene, official_scene)
    )
    for manifest in (ours, theirs):
        for body in (manifest["robot"], manifest["table"], *manifest["objects"]):
            del body["urdf"]
    assert ours == theirs
