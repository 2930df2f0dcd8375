from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from real_bench.conditions import Condition
from real_bench.goal_sets import GoalSet, generate_goal_set, save_goal_set
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.trial import TrialPlan
from real_bench.scoring.result import Result
from real_bench.simulation import Scene, load_scene
from tests.recording.bench import SCENE, ignore

settings.register_profile("patient", deadline=None)
settings.load_profile("patient")

Play = Callable[..., Path]
MakePlan = Callable[..., TrialPlan]
FaceGoals = Callable[..., Result]

GUESTS = Path(__file__).parent / "controllers"


def toy(name: str) -> str:
    """A controller of the folder ``controllers``, such as ``series:Macros``."""
    file, _, kind = name.partition(":")
    return f"{GUESTS / file}.py:{kind}"


@pytest.fixture(scope="session")
def scene() -> Scene:
    return load_scene(SCENE)


@pytest.fixture(scope="session")
def goals(scene: Scene) -> GoalSet:
    return generate_goal_set(scene, 1, seed=5, counts={"2D": 2, "2.5D": 1, "3D": 1})


@pytest.fixture(scope="session")
def goals_path(goals: GoalSet, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("goals") / "goals.npy"
    save_goal_set(goals, path)
    return path


@pytest.fixture
def play(scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Play:
    """Run an intrinsic phase in this process and in an own folder; gives the recording."""
    monkeypatch.chdir(tmp_path)

    def play(
        controller: str,
        steps: int,
        *,
        condition: str = "OM",
        objects: int = 1,
        seed: int = 0,
        out: str = "run.h5",
        images: bool | None = None,
        resume: bool = False,
        overwrite: bool = False,
    ) -> Path:
        path = tmp_path / out
        phase = IntrinsicPhase(
            controller, Condition.parse(condition), objects, scene, steps, seed, path, images
        )
        phase.run(ignore, resume=resume, overwrite=overwrite)
        return path

    return play


@pytest.fixture
def make_plan(scene: Scene, goals: GoalSet) -> MakePlan:
    """What is to be tested: short trials, of two actions."""

    def make_plan(controller: str, condition: str = "OM", **options: Any) -> TrialPlan:
        facts = {"seed": 0, "trial_steps": 1200, "goal_set": goals, **options}
        return TrialPlan(controller, Condition.parse(condition), scene, **facts)

    return make_plan


@pytest.fixture
def face_goals(make_plan: MakePlan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FaceGoals:
    """Run an extrinsic phase from this process and in an own folder; gives the result."""
    monkeypatch.chdir(tmp_path)

    def face_goals(
        controller: str,
        *,
        jobs: int = 1,
        n_trials: int = 4,
        out: str = "score.json",
        resume: bool = False,
        **options: Any,
    ) -> Result:
        phase = ExtrinsicPhase(make_plan(controller, **options), n_trials, tmp_path / out, jobs)
        return phase.run(ignore, resume=resume)

    return face_goals
