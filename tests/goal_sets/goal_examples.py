"""Made-up goals, small enough for hundreds of tests, and files in the official package's form."""

import sys
import types
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from real_bench.goal_sets import CHALLENGES, Goal, GoalSet

OBJECTS = ("cube", "tomato", "mustard")


def make_poses(rng, n_objects):
    poses = rng.normal(size=(n_objects, 7))
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    return poses


def make_goal(rng, n_objects=2, shape=(6, 8), challenge="2D"):
    return Goal(
        challenge=challenge,
        initial_poses=make_poses(rng, n_objects),
        final_poses=make_poses(rng, n_objects),
        retina_before=rng.integers(0, 256, (*shape, 3), dtype=np.uint8),
        retina=rng.integers(0, 256, (*shape, 3), dtype=np.uint8),
        mask=rng.integers(-1, 255, shape, dtype=np.int32),
    )


def make_goal_set(seed=0, n_goals=3, n_objects=2, shape=(6, 8)):
    rng = np.random.default_rng(seed)
    challenges = rng.choice(CHALLENGES, n_goals)
    return GoalSet(
        goals=tuple(make_goal(rng, n_objects, shape, str(name)) for name in challenges),
        object_names=OBJECTS[:n_objects],
        scene="official",
        scene_sha256="0123456789abcdef" * 4,
        generator="realbench-1",
        seed=seed,
    )


goal_sets = st.builds(
    make_goal_set,
    seed=st.integers(0, 2**63 - 1),
    n_goals=st.integers(1, 4),
    n_objects=st.integers(1, 3),
    shape=st.tuples(st.integers(1, 9), st.integers(1, 9)),
)


@contextmanager
def official_goal_class():
    """The class that the official files name, while they are written."""
    Official = type("Goal", (), {"__module__": "real_robots.envs.env"})  # noqa: N806
    names = ("real_robots", "real_robots.envs", "real_robots.envs.env")
    modules = {name: types.ModuleType(name) for name in names}
    vars(modules[names[-1]]).update(Goal=Official)
    sys.modules.update(modules)
    try:
        yield Official
    finally:
        for name in names:
            del sys.modules[name]


def write_official(path: Path, goal_set: GoalSet, **changes: object) -> Path:
    """Write goals as the official package does; ``changes`` replace fields of every goal."""
    with official_goal_class() as goal_class:
        rows = np.empty(len(goal_set), object)
        for index, goal in enumerate(goal_set.goals):
            rows[index] = goal_class()
            vars(rows[index]).update(
                initial_state=dict(zip(goal_set.object_names, goal.initial_poses, strict=True)),
                final_state=dict(zip(goal_set.object_names, goal.final_poses, strict=True)),
                retina_before=goal.retina_before,
                retina=goal.retina,
                mask=goal.mask,
                challenge=goal.challenge,
                subtype=str(goal_set.n_objects),
            )
            vars(rows[index]).update(changes)
        np.savez_compressed(path, rows)
    return path


def with_goal(goal_set, **changes):
    """The set with its first goal changed."""
    first, *others = goal_set.goals
    return replace(goal_set, goals=(replace(first, **changes), *others))
