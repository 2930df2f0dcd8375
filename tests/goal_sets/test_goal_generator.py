import copy
import itertools

import numpy as np
import pytest

from real_bench.errors import GoalSetError, PhysicsError, SceneError
from real_bench.goal_sets import generate_goal_set, generator, save_goal_set
from real_bench.goal_sets.generator import (
    MAX_DRIFT,
    MIN_OBJECT_DISTANCE_M,
    MIN_START_TO_GOAL_M,
    _quaternion_distance,
    _random_quaternions,
    _stays,
)
from real_bench.simulation import Simulation

N_OBJECTS = 2


@pytest.fixture(scope="module")
def scene(official_scene):
    return official_scene


@pytest.fixture(scope="module")
def goal_set(scene):
    return generate_goal_set(scene, N_OBJECTS, seed=4, counts={"2D": 3, "2.5D": 3, "3D": 3})


@pytest.fixture(scope="module")
def states(goal_set):
    """Every goal's challenge with its poses, start and goal alike."""
    return [
        (goal.challenge, poses)
        for goal in goal_set.goals
        for poses in (goal.initial_poses, goal.final_poses)
    ]


def with_region(scene, **changes):
    other = copy.copy(scene)
    region = scene.manifest.goals.model_copy(update=changes)
    other.manifest = scene.manifest.model_copy(update={"goals": region})
    return other


def test_goal_set_records_its_origin(scene, goal_set):
    assert [goal.challenge for goal in goal_set.goals] == ["2D"] * 3 + ["2.5D"] * 3 + ["3D"] * 3
    assert (goal_set.generator, goal_set.seed) == ("realbench-1", 4)
    assert goal_set.object_names == ("cube", "tomato")
    goal_set.check_fits(scene, N_OBJECTS)


def test_every_object_starts_away_from_its_goal(goal_set):
    for goal in goal_set.goals:
        way = np.linalg.norm(goal.initial_poses[:, :2] - goal.final_poses[:, :2], axis=1)
        assert (way >= MIN_START_TO_GOAL_M).all()


def test_objects_are_kept_apart_except_in_3d(states):
    for challenge, poses in states:
        for a, b in itertools.combinations(poses[:, :3], 2):
            assert challenge == "3D" or np.linalg.norm(a - b) >= MIN_OBJECT_DISTANCE_M


def test_orientations_are_kept_except_in_3d(scene, states):
    with Simulation(scene, N_OBJECTS) as simulation:
        rest = simulation.object_poses()[:, 3:]
    drifts: dict[str, list[float]] = {"2D": [], "2.5D": [], "3D": []}
    for challenge, poses in states:
        drifts[challenge].append(_quaternion_distance(poses[:, 3:], rest).max())
    assert max(drifts["2D"] + drifts["2.5D"]) <= MAX_DRIFT < min(drifts["3D"])


def test_only_2d_stays_off_the_shelf(scene, goal_set):
    shelf_from_x = scene.manifest.goals.shelf_drop_from_x
    for goal in goal_set.goals:
        x = np.append(goal.initial_poses[:, 0], goal.final_poses[:, 0])
        assert (x > shelf_from_x).any() == (goal.challenge != "2D")


def test_images_match_what_a_trial_shows_first(scene, goal_set):
    with Simulation(scene, N_OBJECTS) as simulation:
        for goal in goal_set.goals:
            simulation.reset(goal.initial_poses)
            np.testing.assert_array_equal(simulation.image().retina, goal.retina_before)
            simulation.reset(goal.final_poses)
            image = simulation.image()
            np.testing.assert_array_equal(image.retina, goal.retina)
            np.testing.assert_array_equal(image.mask, goal.mask)


def test_objects_stay_at_their_initial_poses(scene, goal_set):
    with Simulation(scene, N_OBJECTS) as simulation:
        for goal in goal_set.goals[::3]:
            assert _stays(simulation, goal.initial_poses)


def test_balancing_object_is_detected(scene):
    on_its_edge = np.array([[0.078, 0.084, 0.423, 0.689, -0.255, -0.615, -0.286]])
    with Simulation(scene, 1) as simulation:
        assert not _stays(simulation, on_its_edge)


def test_the_same_seed_gives_the_same_file(scene, tmp_path):
    first, second, other = (tmp_path / name for name in ("1.npy", "2.npy", "3.npy"))
    for path, seed in ((first, 7), (second, 7), (other, 8)):
        save_goal_set(generate_goal_set(scene, 1, seed, {"2D": 1, "3D": 1}), path)
    assert first.read_bytes() == second.read_bytes() != other.read_bytes()


def test_a_goal_does_not_depend_on_how_many_are_drawn(scene, goal_set):
    few = generate_goal_set(scene, N_OBJECTS, seed=4, counts={"3D": 1, "2.5D": 1})
    assert [goal.sha256 for goal in few.goals] == [
        goal_set.goals[3].sha256,
        goal_set.goals[6].sha256,
    ]


def test_progress_is_reported_after_each_goal(scene):
    told = []
    generate_goal_set(scene, 1, 0, {"2D": 2}, lambda *numbers: told.append(numbers))
    assert told == [(1, 2), (2, 2)]


@pytest.mark.parametrize(
    ("seed", "counts", "message"),
    [
        (0, {"2D": 0}, "ask for at least one"),
        (0, {}, "ask for at least one"),
        (0, {"2D": 3, "3D": -1}, "none below 0"),
        (0, {"4D": 1}, "unknown challenge '4D'"),
        (-1, {"2D": 1}, "seed must be .*, not -1"),
        (2**63, {"2D": 1}, "seed must be .*, not 9223372036854775808"),
        (0, {"2D": 10**9}, "too many, at most"),
    ],
)
def test_impossible_requests_are_refused_before_simulating(
    scene, monkeypatch, seed, counts, message
):
    monkeypatch.delattr(generator, "Simulation")
    with pytest.raises(GoalSetError, match=message):
        generate_goal_set(scene, 1, seed, counts)


def test_too_many_objects_are_refused(scene):
    with pytest.raises(SceneError, match="from 1 to 3, not 4"):
        generate_goal_set(scene, 4, 0)


def test_a_region_without_room_is_an_error(scene):
    narrow = with_region(scene, table_low=(-0.1, -0.05), table_high=(0.0, 0.05))
    with pytest.raises(GoalSetError, match=r"has no 2D goal for 1 object .* no room"):
        generate_goal_set(narrow, 1, 0, {"2D": 1})


def test_a_region_where_everything_falls_is_an_error(scene, monkeypatch):
    monkeypatch.setattr(generator, "MAX_SETTLINGS", 3)
    beside_the_table = with_region(scene, table_low=(-0.3, -2.0), table_high=(0.0, -1.0))
    with pytest.raises(GoalSetError, match="none of 3 draws settled"):
        generate_goal_set(beside_the_table, 1, 0, {"2D": 1})


def test_exploding_draw_is_repeated(scene, monkeypatch):
    settle, calls = generator._settle, []

    def explode_once(simulation, poses):
        calls.append(poses)
        if len(calls) == 1:
            raise PhysicsError("the physics exploded")
        return settle(simulation, poses)

    monkeypatch.setattr(generator, "_settle", explode_once)
    assert len(generate_goal_set(scene, 1, 0, {"2D": 1})) == 1
    assert len(calls) >= 3


def test_random_orientations_are_spread_evenly():
    quaternions = _random_quaternions(np.random.default_rng(0), 20_000)
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1)
    np.testing.assert_allclose(quaternions.mean(axis=0), 0, atol=0.02)
    np.testing.assert_allclose(quaternions.T @ quaternions / 20_000, np.eye(4) / 4, atol=0.01)


def test_opposite_quaternions_are_the_same_orientation():
    quaternions = _random_quaternions(np.random.default_rng(0), 5)
    np.testing.assert_array_equal(_quaternion_distance(quaternions, -quaternions), 0)
