"""REAL-G where it is told no positions: it plays, is cut and goes on, learns to see, is tested."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from real_bench.controllers.real_g import RealGSeen, RealGSettings

from real_bench.actions import Action
from real_bench.conditions import Condition
from real_bench.goal_sets import generate_goal_set
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.trial import TrialPlan
from real_bench.real_g.hand import Push
from real_bench.real_g.seen_images import ImagePerception
from real_bench.recording import Experience, Recording
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from real_bench.task import Task
from tests.real_g.test_controller import SMALL, commands
from tests.recording.bench import ignore

IM, IC = Condition.parse("IM"), Condition.parse("IC")
LENGTH = 90_000


@pytest.fixture(scope="module")
def pushed(builtin_scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Free play with macros and images."""
    out = tmp_path_factory.mktemp("pushed") / "run.h5"
    IntrinsicPhase("real_g", IM, 1, builtin_scene, LENGTH, 2, out, settings=SMALL).run(ignore)
    return out


def test_object_is_located_after_being_pushed(builtin_scene: Scene, pushed: Path) -> None:
    task = Task(builtin_scene, IM, 1)
    task.close()
    push = Push(task.action_space)
    ends = list(push.end)
    seen = ImagePerception(push.low[ends], push.high[ends])

    def path_of(action: Action) -> np.ndarray | None:
        numbers = push.parameters(action)
        return None if numbers is None else push.path(numbers)

    seen.recall(Experience(pushed, IM), path_of)
    rows = seen.rows()
    with Recording(pushed) as recording:
        truth = recording.object_poses[:, 0, :2]
    assert rows.shape == (len(truth), 1, 3)
    errors = np.linalg.norm(rows[:, 0, :2] - truth, axis=1)
    assert np.nanmedian(errors) < 0.1  # of so few actions


@pytest.mark.parametrize("condition", [IM, IC], ids=["IM", "IC"])
def test_the_same_seed_gives_the_same_play(
    builtin_scene: Scene, tmp_path: Path, condition: Condition
) -> None:
    paths = [tmp_path / "1.h5", tmp_path / "2.h5"]
    for path in paths:
        phase = IntrinsicPhase("real_g", condition, 1, builtin_scene, 6500, 2, path, settings=SMALL)
        phase.run(ignore)
    assert commands(paths[0]).tobytes() == commands(paths[1]).tobytes()  # NaN included


def test_play_is_resumed_from_its_recording(
    builtin_scene: Scene, pushed: Path, tmp_path: Path
) -> None:
    with Recording(pushed) as recording:
        state = recording.controller_state()
    task = Task(builtin_scene, IM, 1)
    task.begin()
    settings = RealGSettings.model_validate(SMALL)
    controller = RealGSeen(task.action_space, task.observation_space, settings)
    controller.set_state({**state, "lesson": None, "skills": []})
    controller.resume_intrinsic_phase(Experience(pushed, IM))
    assert isinstance(controller.next_action(task.observe()), Action)
    task.close()


def test_trials_are_the_same_with_two_processes(
    builtin_scene: Scene, pushed: Path, tmp_path: Path
) -> None:
    goals = generate_goal_set(builtin_scene, 1, seed=5, counts={"2D": 2})
    hashes = []
    for number, jobs in enumerate([1, 2]):
        plan = TrialPlan(*("real_g", IM, builtin_scene, goals, 0, 2000, pushed), settings=SMALL)
        out = tmp_path / f"{number}.json"
        ExtrinsicPhase(plan, 2, out, jobs).run(ignore)
        hashes.append([trial.actions_sha256 for trial in load_result(out).trials])
    assert hashes[0] == hashes[1]
