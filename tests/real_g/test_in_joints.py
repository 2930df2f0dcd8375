"""REAL-G in joints as a controller: watches, plays, is cut and goes on, is tested."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from real_bench.controllers.real_gj import RealGJ, RealGJSettings

from real_bench.conditions import Condition
from real_bench.errors import ControllerError, Interrupted
from real_bench.goal_sets import generate_goal_set
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.intrinsic import IntrinsicPhase, Progress
from real_bench.phases.trial import TrialPlan
from real_bench.real_g.joint_push import JointPush
from real_bench.recording import Experience, Recording
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from real_bench.spaces import action_space, observation_space
from tests.real_g.noting import SEEN
from tests.recording.bench import ignore

IJ = Condition.parse("IJ")
SMALL: dict[str, Any] = {
    "watching": {
        **{"grips": 20, "random": 30, "starts": 2, "tried": 30, "reached": 20},
        **{"grid": 4, "refined": 1},
    },
    "play": {"first": 35, "fewest_steps": 10, "most_steps": 20, "last_steps": 20, "candidates": 20},
    "planner": {"samples": 40, "rounds": 2},
}
STEPS = 33_000


def phase(scene: Scene, out: Path, steps: int = STEPS) -> IntrinsicPhase:
    return IntrinsicPhase("tests.real_g.noting:Noting", IJ, 1, scene, steps, 3, out, settings=SMALL)


def made(scene: Scene) -> RealGJ:
    spaces = action_space(scene, IJ), observation_space(scene, IJ, 1)
    return RealGJ(*spaces, RealGJSettings.model_validate(SMALL))


def commands(path: Path) -> NDArray[Any]:
    with Recording(path) as recording:
        return recording.commands()


@pytest.fixture(scope="module")
def played(builtin_scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("played") / "run.h5"
    SEEN.clear()
    phase(builtin_scene, out).run(ignore)
    return out


def n_watched(path: Path) -> int:
    with Recording(path) as recording:
        return int(recording.controller_state()["watching"]["actions"])


def test_it_watches_then_pushes_and_comes_home(played: Path) -> None:
    experience, watched = Experience(played, IJ), n_watched(played)
    pushes = experience.since(watched)
    assert len(pushes) > 3
    assert (experience.durations[:watched] != JointPush.steps).all()
    assert (pushes.durations[:-1] == JointPush.steps).all()
    assert np.abs(pushes.joint_positions[:-1]).max() < 0.1


def test_state_at_any_moment_of_watching_continues_it(builtin_scene: Scene, played: Path) -> None:
    experience, lived = Experience(played, IJ), made(builtin_scene)
    lived.seed(3)
    for number in range(n_watched(played) + 1):
        resumed = made(builtin_scene)
        resumed.set_state(lived.get_state())
        expected = experience.action(number).commands
        for controller in (resumed, lived):
            np.testing.assert_array_equal(controller.next_action(SEEN[number]).commands, expected)


def test_recalled_play_gives_the_same_memory_as_a_lived_one(
    builtin_scene: Scene, played: Path
) -> None:
    experience, watched = Experience(played, IJ), n_watched(played)
    lived, recalls = made(builtin_scene), made(builtin_scene)
    lived.seed(3)
    for number in range(len(experience)):
        lived.next_action(SEEN[number])
    recalls.set_state(lived.get_state())
    recalls.resume_intrinsic_phase(experience)
    assert lived._play is not None
    assert recalls._play is not None
    one, other = lived._play._parameters, recalls._play._parameters
    assert len(one) == len(other) == len(experience) - watched
    np.testing.assert_allclose(one[:-1], other[:-1], atol=1e-7)  # the last one was cut


@pytest.mark.parametrize("cut", [9_000, 22_000])
def test_interrupted_play_goes_on(
    builtin_scene: Scene, played: Path, tmp_path: Path, cut: int
) -> None:
    """It stops while it watches, or among its pushes."""
    out = tmp_path / "run.h5"

    def stop(progress: Progress) -> None:
        if progress.n_steps >= cut:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(Interrupted):
        phase(builtin_scene, out).run(stop)
    before = commands(out)
    phase(builtin_scene, out).run(ignore, resume=True)
    for name in ("command", "n_steps"):
        np.testing.assert_array_equal(commands(out)[name][: len(before)], before[name])
        np.testing.assert_array_equal(commands(played)[name][: len(before)], before[name])
    with Recording(out) as recording:
        assert recording.n_steps == STEPS
    assert len(Experience(out, IJ).since(n_watched(out))) > 3


def test_trials_match_across_processes(builtin_scene: Scene, played: Path, tmp_path: Path) -> None:
    goals = generate_goal_set(builtin_scene, 1, seed=5, counts={"2D": 2})
    hashes = []
    for jobs in (1, 2):
        plan = TrialPlan(
            "tests.real_g.noting:Noting", IJ, builtin_scene, goals, 0, 2000, played, settings=SMALL
        )
        out = tmp_path / f"{jobs}.json"
        ExtrinsicPhase(plan, 2, out, jobs).run(ignore)
        hashes.append([trial.actions_sha256 for trial in load_result(out).trials])
    assert hashes[0] == hashes[1]


def test_tests_without_its_own_play_are_refused(builtin_scene: Scene, played: Path) -> None:
    controller = made(builtin_scene)
    controller.use_experience(Experience(played, IJ))
    with pytest.raises(ControllerError, match="--run"):
        controller.start_extrinsic_phase()
