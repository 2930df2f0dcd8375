from __future__ import annotations

import pytest
from hypothesis import settings

from real_bench.actions import Action
from real_bench.scoring.commands import Commands
from real_bench.scoring.result import Result, Setting, TrialResult

settings.register_profile("patient", deadline=None)
settings.load_profile("patient")


@pytest.fixture(scope="session")
def setting() -> Setting:
    return Setting(
        condition="OM",
        objects=2,
        object_names=("cube", "tomato"),
        scene="builtin",
        scene_sha256="1" * 64,
        controller="real_r",
        controller_sha256="2" * 64,
        run_sha256="",
        run_steps=0,
        goals_sha256="3" * 64,
        n_goals=4,
        goal_numbers=(0, 1, 2, 3),
        trial_steps=10_000,
        seed=0,
        versions={"python": "3.11"},
    )


@pytest.fixture(scope="session")
def commands() -> Commands:
    """Of 10,000 steps."""
    return Commands.of([Action.macro([[-0.1, 0.01 * k], [0.0, -0.2]]) for k in range(10)])


@pytest.fixture(scope="session")
def result(setting: Setting, commands: Commands) -> Result:
    """Three of four trials: objects at their goals, 10 cm away, 20 cm away."""
    result = Result(setting=setting)
    for goal, (challenge, distance) in enumerate([("2D", 0.0), ("2D", 0.1), ("3D", 0.2)]):
        trial = TrialResult(
            goal=goal,
            challenge=challenge,
            distances=(distance, distance),
            final_poses=((0.1, 0.2, 0.3, 0, 0, 0, 1), (0.3, 0.2, 0.1, 0, 0, 0, 1)),
            actions_sha256=commands.sha256,
            commands=commands,
        )
        result = result.with_trial(trial, seconds=1.5)
    return result
