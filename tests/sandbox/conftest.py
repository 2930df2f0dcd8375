"""Fixtures of the tests of isolation: the phases', with controllers in a process of their own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from real_bench.conditions import Condition
from real_bench.goal_sets import GoalSet, generate_goal_set
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.local import LocalBackend
from real_bench.phases.proxy import ControllerBackend
from real_bench.phases.trial import TrialPlan
from real_bench.sandbox import (
    Limits,
    SandboxBackend,
    SandboxSupport,
    kernel_support,
    sandbox_support,
)
from real_bench.scoring.result import Result
from real_bench.simulation import Scene, load_scene
from tests.recording.bench import SCENE, ignore

LIMITS = Limits(memory_gib=4, call_s=60, total_s=300)
Play = Callable[..., Path]
Face = Callable[..., Result]


@pytest.fixture(scope="session")
def scene() -> Scene:
    return load_scene(SCENE)


@pytest.fixture(scope="session")
def goals(scene: Scene) -> GoalSet:
    return generate_goal_set(scene, 1, seed=5, counts={"2D": 2})


@pytest.fixture
def isolated() -> SandboxBackend:
    return SandboxBackend(limits=LIMITS)


@pytest.fixture
def sandboxed() -> SandboxSupport:
    """Bubblewrap, where it works."""
    support = sandbox_support()
    if support.bubblewrap is None:
        pytest.skip("bubblewrap is not installed, or does not work here")
    return support


@pytest.fixture(params=["bubblewrap", "landlock"])
def support(request: pytest.FixtureRequest) -> SandboxSupport:
    """Each kind of support that keeps files out of reach, where this system has it."""
    found = sandbox_support() if request.param == "bubblewrap" else kernel_support()
    if not getattr(found, request.param):
        pytest.skip(f"{request.param} is not installed, or does not work here")
    return found


@pytest.fixture
def play(scene: Scene, tmp_path: Path) -> Play:
    """Run an intrinsic phase; gives the recording."""

    def play(
        controller: str,
        steps: int = 1000,
        *,
        backend: ControllerBackend | None = None,
        condition: str = "OM",
        out: str = "run.h5",
        resume: bool = False,
        settings: dict[str, Any] | None = None,
    ) -> Path:
        phase = IntrinsicPhase(
            controller,
            Condition.parse(condition),
            1,
            scene,
            steps,
            0,
            tmp_path / out,
            settings=settings or {},
            backend=backend or LocalBackend(),
        )
        phase.run(ignore, resume=resume).close()
        return phase.out

    return play


@pytest.fixture
def face_goals(scene: Scene, goals: GoalSet, tmp_path: Path) -> Face:
    """Run an extrinsic phase; gives the result."""

    def face_goals(
        controller: str,
        *,
        backend: ControllerBackend | None = None,
        condition: str = "OM",
        trial_steps: int = 1000,
        run: Path | None = None,
        run_steps: int | None = None,
        settings: dict[str, Any] | None = None,
        jobs: int = 1,
        out: str = "score.json",
    ) -> Result:
        plan = TrialPlan(
            controller=controller,
            condition=Condition.parse(condition),
            scene=scene,
            goal_set=goals,
            seed=0,
            trial_steps=trial_steps,
            run=run,
            run_steps=run_steps,
            settings=settings or {},
            backend=backend or LocalBackend(),
        )
        return ExtrinsicPhase(plan, len(goals), tmp_path / out, jobs).run(ignore)

    return face_goals
