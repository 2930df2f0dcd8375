"""REAL-G as a controller: plays, is cut and goes on, learns, is tested."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from real_bench.controllers.real_g import RealGSeen, RealGSettings

from real_bench.actions import Action
from real_bench.conditions import Condition
from real_bench.errors import ControllerError
from real_bench.goal_sets import generate_goal_set
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.trial import TrialPlan
from real_bench.real_g import (
    PlannerSettings,
    PlaySettings,
    PosePerception,
    RealG,
    primitive_of,
)
from real_bench.real_g.architecture import MAX_IDLE
from real_bench.recording import Experience, Recording
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from real_bench.task import Task
from tests.recording.bench import SCENE, ignore, realbench, recorded_steps, run, start

CONDITIONS = [Condition.parse("OM"), Condition.parse("OC")]
PLAY = {"first": 35, "fewest_steps": 10, "most_steps": 20, "last_steps": 20, "candidates": 20}
SMALL = {"play": PLAY, "planner": {"samples": 40, "rounds": 2}}
CUT = 37_500


def play(scene: Scene, condition: Condition, out: Path, steps: int, objects: int = 1) -> Path:
    phase = IntrinsicPhase("real_g", condition, objects, scene, steps, 2, out, settings=SMALL)
    phase.run(ignore, resume=True)
    return out


def made(scene: Scene, condition: Condition, objects: int = 1) -> RealGSeen:
    task = Task(scene, condition, objects)
    task.close()
    settings = RealGSettings.model_validate(SMALL)
    return RealGSeen(task.action_space, task.observation_space, settings)


def commands(path: Path) -> NDArray[Any]:
    with Recording(path) as recording:
        return recording.commands()


@pytest.fixture(scope="module", params=CONDITIONS, ids=["OM", "OC"])
def played(
    request: pytest.FixtureRequest, builtin_scene: Scene, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    folder = tmp_path_factory.mktemp("played")
    return play(builtin_scene, request.param, folder / "run.h5", CUT)


def condition_of(path: Path) -> Condition:
    with Recording(path) as recording:
        return Condition.parse(recording.header.condition)


def test_the_same_seed_gives_the_same_play(
    builtin_scene: Scene, tmp_path: Path, played: Path
) -> None:
    again = play(builtin_scene, condition_of(played), tmp_path / "again.h5", CUT)
    for name in ("command", "n_steps"):  # of which a row of NaN is a rest
        np.testing.assert_array_equal(commands(again)[name], commands(played)[name])


def test_recalled_play_gives_the_same_memory_as_a_lived_one(
    builtin_scene: Scene, played: Path
) -> None:
    condition = condition_of(played)
    experience = Experience(played, condition)
    lived, recalls = made(builtin_scene, condition), made(builtin_scene, condition)
    for controller in (lived, recalls):
        controller.seed(2)
    with Recording(played) as recording:
        poses = recording.object_poses
        name = recording.header.object_names[0]
    seen = [
        {"object_positions": {name: pose[0, :3]}, "object_orientations": {name: pose[0, 3:]}}
        for pose in poses
    ]
    for number in range(len(experience)):
        action = lived.next_action(seen[number])
        expected = experience.action(number)
        np.testing.assert_array_equal(action.first(expected.duration).commands, expected.commands)
    # the last action was cut, which only the recording knows: no outcome of it is seen alive
    memory = copy.deepcopy(lived._play.skills[0].memory)
    recalls.set_state(lived.get_state())
    recalls.resume_intrinsic_phase(experience)
    chosen = [controller.next_action(seen[-1]).commands for controller in (lived, recalls)]
    assert chosen[0].shape == chosen[1].shape
    again = recalls._play.skills[0].memory
    assert len(memory._recent) > len(experience) / 2
    for one, other in zip(memory._recent, again._recent, strict=True):
        np.testing.assert_allclose(np.hstack(one), np.hstack(other), atol=1e-7)
    for family, recalled in zip(memory.families, again.families, strict=True):
        np.testing.assert_allclose(family.members, recalled.members, atol=1e-7)
        np.testing.assert_allclose(family.successes, recalled.successes, atol=1e-7)


def test_it_does_something_else_as_long_as_nothing_moves(builtin_scene: Scene) -> None:
    task = Task(builtin_scene, CONDITIONS[0], 1)
    task.close()
    spaces = task.action_space, task.observation_space
    settings = PlaySettings.model_validate(PLAY), PlannerSettings()
    otherwise = Action.rest(4, 700)
    controller = RealG(
        *spaces, primitive_of(spaces[0]), PosePerception(), *settings, lambda random: otherwise
    )

    def chosen(x: float) -> bool:
        seen = {
            "object_positions": {"cube": [x, 0.0, 0.3]},
            "object_orientations": {"cube": [0.0, 0.0, 0.0, 1.0]},
        }
        return controller.next_action(seen) is otherwise

    assert [chosen(0.0) for _ in range(MAX_IDLE + 3)] == [False] * MAX_IDLE + [True] * 3
    assert not chosen(0.1)


def test_killed_play_is_resumed(tmp_path: Path) -> None:
    command = realbench(
        *("intrinsic", "--controller", "real_g", "--condition", "OM", "--scene", SCENE),
        *("--resume", "--steps", 37_000, "--set", "play.first=33", "--set", "play.last_steps=10"),
        eager=True,
    )
    out = tmp_path / "run.h5"
    process = start(command, tmp_path)
    assert process.stderr is not None
    assert any("learning from 33 actions" in line for line in process.stderr)
    process.kill()
    process.communicate()
    begun, before = recorded_steps(out), commands(out)
    assert begun < 37_000
    finished = run(command, tmp_path)
    assert finished.returncode == 0, finished.stderr
    assert recorded_steps(out) == 37_000
    np.testing.assert_array_equal(commands(out)[: len(before)], before)


@pytest.mark.parametrize("played", CONDITIONS[1:], ids=["OC"], indirect=True)
def test_trials_match_across_processes_and_run_on_first_steps_alone(
    builtin_scene: Scene, played: Path, tmp_path: Path
) -> None:
    goals = generate_goal_set(builtin_scene, 1, seed=5, counts={"2D": 2})
    hashes = []
    for number, (jobs, steps) in enumerate([(1, None), (2, None), (1, CUT)]):
        plan = TrialPlan(
            *("real_g", condition_of(played), builtin_scene, goals, 0, 2000, played, steps),
            settings=SMALL,
        )
        out = tmp_path / f"{number}.json"
        ExtrinsicPhase(plan, 2, out, jobs).run(ignore)
        hashes.append([trial.actions_sha256 for trial in load_result(out).trials])
    assert hashes[0] == hashes[1]
    assert len(hashes[0]) == len(hashes[2]) == 2


def test_state_and_copy_choose_the_same_action(builtin_scene: Scene, played: Path) -> None:
    condition = condition_of(played)
    first, heir = made(builtin_scene, condition), made(builtin_scene, condition)
    experience = Experience(played, condition)
    first.use_experience(experience)
    heir.set_state(first.get_state())
    heir.use_experience(experience)
    task = Task(builtin_scene, condition, 1)
    task.begin(generate_goal_set(builtin_scene, 1, seed=5, counts={"2D": 1}).goals[0])
    chosen = []
    for controller in (first, heir, copy.deepcopy(first)):
        controller.seed(7)
        controller.start_extrinsic_phase()
        controller.start_extrinsic_trial()
        chosen.append(controller.next_action(task.observe()).commands)
        explained = controller.explain()
        assert explained is not None
        assert explained.facts["object"] == 0
    task.close()
    np.testing.assert_array_equal(chosen[0], chosen[1])
    np.testing.assert_array_equal(chosen[0], chosen[2])


def test_each_of_two_objects_has_its_own_skill(builtin_scene: Scene, tmp_path: Path) -> None:
    condition = CONDITIONS[0]
    path = play(builtin_scene, condition, tmp_path / "two.h5", 4000, objects=2)
    controller = made(builtin_scene, condition, 2)
    controller.use_experience(Experience(path, condition))
    assert len(controller._play.skills) == 2


def test_extrinsic_phase_without_a_play_is_refused(builtin_scene: Scene) -> None:
    with pytest.raises(ControllerError, match="--run"):
        made(builtin_scene, CONDITIONS[0]).start_extrinsic_phase()


def test_a_play_too_short_to_learn_from_can_be_tested(builtin_scene: Scene, tmp_path: Path) -> None:
    path = play(builtin_scene, CONDITIONS[0], tmp_path / "short.h5", 1500)
    goals = generate_goal_set(builtin_scene, 1, seed=5, counts={"2D": 1})
    plan = TrialPlan(
        *("real_g", CONDITIONS[0], builtin_scene, goals, 0, 1000, path), settings=SMALL
    )
    assert ExtrinsicPhase(plan, 1, tmp_path / "score.json").run(ignore).is_complete


def test_part_of_a_play_without_a_whole_action_is_declined(
    builtin_scene: Scene, tmp_path: Path
) -> None:
    path = play(builtin_scene, CONDITIONS[0], tmp_path / "short.h5", 1500)
    controller = made(builtin_scene, CONDITIONS[0])
    controller.use_experience(Experience(path, CONDITIONS[0], 500))
    with pytest.raises(ControllerError, match="--run"):
        controller.start_extrinsic_phase()
