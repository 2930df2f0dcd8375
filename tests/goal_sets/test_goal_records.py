from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from real_bench.errors import GoalSetError
from real_bench.goal_sets import GoalSet
from real_bench.goal_sets.goal import MAX_PIXELS, check_size
from tests.goal_sets.goal_examples import goal_sets, make_goal, make_goal_set, with_goal


@pytest.fixture
def goal_set():
    return make_goal_set()


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("challenge", "4D", "unknown challenge '4D': use one of 2D, 2.5D, 3D"),
        ("initial_poses", np.zeros((2, 6)), r"shape \(2, 6\), not \(n_objects, 7\)"),
        ("initial_poses", np.zeros((0, 7)), r"shape \(0, 7\)"),
        ("initial_poses", np.full((2, 7), np.nan), "must be finite"),
        ("final_poses", np.zeros((2, 7)), "quaternions must have length 1"),
        ("final_poses", np.tile(np.eye(7)[6], (3, 1)), "must agree"),
        ("retina", np.zeros((6, 8, 3)), "retina is float64"),
        ("retina_before", np.zeros((6, 9, 3), np.uint8), "retina_before is uint8"),
        ("mask", np.zeros((6, 8)), "mask is float64"),
        ("mask", np.full((6, 8), 255), "body ids 255 to 255"),
        ("mask", np.full((6, 8), -2), "body ids -2 to -2"),
    ],
)
def test_goal_refuses_invalid_fields(goal_set, field, value, message):
    with pytest.raises(GoalSetError, match=message):
        with_goal(goal_set, **{field: value})


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("goals", (), "at least one goal"),
        (
            "goals",
            (make_goal(np.random.default_rng(0), n_objects=1),),
            "goal 0 places 1 object, but the set names 2",
        ),
        ("object_names", ("cube", "cube"), "name each once"),
        ("object_names", ("cube", "a name"), "'a name' must match"),
        ("scene", "", "name '' must match"),
        ("scene_sha256", "abc", "scene_sha256 'abc' must match"),
        ("generator", "two words", "generator 'two words' must match"),
        ("seed", -2, "seed -2"),
        ("seed", 2**63, "seed 9223372036854775808"),
    ],
)
def test_goal_set_refuses_invalid_fields(goal_set, field, value, message):
    with pytest.raises(GoalSetError, match=message):
        replace(goal_set, **{field: value})


def test_images_of_all_goals_have_one_size(goal_set):
    other = make_goal(np.random.default_rng(0), shape=(8, 6))
    with pytest.raises(GoalSetError, match="goal 3: images"):
        replace(goal_set, goals=(*goal_set.goals, other))


def test_arrays_are_copies_and_cannot_be_written(goal_set):
    poses = goal_set.goals[0].initial_poses.copy()
    changed = with_goal(goal_set, initial_poses=poses)
    poses[0, 0] += 1
    assert changed.sha256 == goal_set.sha256
    with pytest.raises(ValueError, match="read-only"):
        changed.goals[0].retina[0, 0, 0] = 1


@given(goal_sets)
def test_counts_add_up(goal_set):
    assert sum(goal_set.counts.values()) == len(goal_set) == len(goal_set.goals)
    assert goal_set.n_objects == goal_set.goals[0].n_objects


def test_hash_changes_with_every_field_and_nothing_else(goal_set: GoalSet):
    first = goal_set.goals[0]
    variants = [
        replace(goal_set, seed=5),
        replace(goal_set, generator="other-1"),
        replace(goal_set, goals=goal_set.goals[::-1]),
        replace(goal_set, goals=goal_set.goals[:2]),
        with_goal(goal_set, initial_poses=first.final_poses, final_poses=first.initial_poses),
        with_goal(goal_set, retina=first.retina_before),
        with_goal(goal_set, mask=first.mask[::-1]),
    ]
    assert len({goal_set.sha256, *(variant.sha256 for variant in variants)}) == len(variants) + 1
    assert replace(goal_set).sha256 == goal_set.sha256


def test_too_many_pixels_are_refused():
    n_goals = MAX_PIXELS // (240 * 320)
    check_size(n_goals, 240, 320)
    with pytest.raises(GoalSetError, match=f"at most {n_goals} fit"):
        check_size(n_goals + 1, 240, 320)


def test_goal_set_fits_only_its_scene_and_number_of_objects(official_scene):
    fitting = replace(make_goal_set(), scene_sha256=official_scene.sha256)
    fitting.check_fits(official_scene, 2)
    with pytest.raises(GoalSetError, match="use --objects 2"):
        fitting.check_fits(official_scene, 1)
    with pytest.raises(GoalSetError, match="the goals were made in scene official"):
        make_goal_set().check_fits(official_scene, 2)
