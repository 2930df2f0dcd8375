from __future__ import annotations

import functools
import json
import operator
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
from real_bench.scoring.result_file import sealed
from real_bench.simulation import Scene
from tests.recording.bench import ignore

settings.register_profile("patient", deadline=None)
settings.load_profile("patient")

TRIAL_STEPS, N_TRIALS = 800, 2  # long enough to push, short enough to be replayed a hundred times
CUT_AT, RUN_STEPS = 2000, 4500

MakeResult = Callable[..., Path]
Alter = Callable[..., Path]


@pytest.fixture(scope="session")
def goals(builtin_scene: Scene) -> GoalSet:
    return generate_goal_set(builtin_scene, 1, seed=5, counts={"2D": 3})


@pytest.fixture(scope="session")
def goals_path(goals: GoalSet, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("goals") / "goals.npy"
    save_goal_set(goals, path)
    return path


@pytest.fixture(scope="session")
def make_result(
    builtin_scene: Scene, goals: GoalSet, tmp_path_factory: pytest.TempPathFactory
) -> MakeResult:
    """Run a short extrinsic phase; gives its result file."""

    def make_result(
        controller: str = "real_r", condition: str = "OM", n_trials: int = N_TRIALS, **options: Any
    ) -> Path:
        out = tmp_path_factory.mktemp("result") / "score.json"
        facts: dict[str, Any] = {"seed": 0, "trial_steps": TRIAL_STEPS, "goal_set": goals}
        facts |= options
        plan = TrialPlan(controller, Condition.parse(condition), builtin_scene, **facts)
        ExtrinsicPhase(plan, n_trials, out).run(ignore)
        return out

    return make_result


@pytest.fixture(scope="session")
def honest(make_result: MakeResult) -> Path:
    """A result as it was made."""
    return make_result()


@pytest.fixture(scope="session")
def recorded(builtin_scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of two objects with images, that was cut once."""
    out = tmp_path_factory.mktemp("recorded") / "run.h5"
    for steps in (CUT_AT, RUN_STEPS):
        play(builtin_scene, out, steps, objects=2, images=True)
    return out


def play(
    scene: Scene,
    out: Path,
    steps: int,
    *,
    controller: str = "real_r",
    condition: str = "OM",
    objects: int = 1,
    images: bool | None = None,
) -> Path:
    """Play on to so many steps."""
    phase = IntrinsicPhase(
        controller, Condition.parse(condition), objects, scene, steps, 3, out, images
    )
    phase.run(ignore, resume=True)
    return out


def altered(path: Path, place: tuple[Any, ...], change: Callable[[Any], Any]) -> Path:
    """A copy of a result with one value changed, and sealed anew by a forger."""
    content = json.loads(path.read_text())
    holder = functools.reduce(operator.getitem, place[:-1], content)
    holder[place[-1]] = change(holder[place[-1]])
    return forged(path, content)


def forged(path: Path, content: dict[str, Any]) -> Path:
    """A result of this content beside another one, sealed."""
    forgery = path.with_name("forged.json")
    forgery.write_text(json.dumps(sealed(content)))
    return forgery
