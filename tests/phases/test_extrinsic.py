from __future__ import annotations

import contextlib
import json
import os
import signal
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from real_bench.conditions import Condition
from real_bench.errors import (
    ControllerError,
    PhysicsError,
    RealBenchError,
    RecordingError,
    ResultError,
)
from real_bench.goal_sets import Goal, GoalSet, load_goal_set
from real_bench.phases.extrinsic import ExtrinsicPhase, _differences
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.trial import TrialMaker
from real_bench.scoring.commands import largest_length
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from real_bench.task import Task
from tests.phases.conftest import FaceGoals, MakePlan, Play, toy
from tests.recording.bench import SCENE, ignore, realbench, run, start, wait_for, wait_until

LINUX = pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for processes in /proc")


def scores(path: Path) -> dict[str, Any]:
    """A result file but for the time it took."""
    content: dict[str, Any] = json.loads(path.read_text())
    assert content.pop("timing")
    return content


@pytest.mark.parametrize(
    ("controller", "condition"),
    [("real_r", "IM"), (toy("tested:Changes"), "OM"), (toy("tested:GlobalRandomness"), "OJ")],
)
def test_two_processes_give_the_same_as_one(
    face_goals: FaceGoals, controller: str, condition: str
) -> None:
    for jobs, out in ((1, "one"), (2, "two")):
        face_goals(controller, condition=condition, jobs=jobs, out=out, trial_steps=1200)
    assert scores(Path("one")) == scores(Path("two"))


def test_first_failure_is_told_not_what_follows_from_it(face_goals: FaceGoals) -> None:
    with pytest.raises(ControllerError, match=r"goal 0: .*the first reason"):
        face_goals(toy("faulty:FailsTwice"), n_trials=1)


@pytest.mark.parametrize(
    ("controller", "warned"), [(toy("tested:GlobalRandomness"), True), ("real_r", False)]
)
def test_result_that_may_grow_too_large_is_told_before_the_test(
    face_goals: FaceGoals,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    controller: str,
    warned: bool,
) -> None:
    """And the bound is none that random commands exceed."""
    bound = largest_length(9, 200)
    monkeypatch.setattr("real_bench.phases.extrinsic.MAX_FILE_BYTES", 2 * bound - 1)
    result = face_goals(controller, condition="OJ", trial_steps=200, n_trials=2)
    assert ("fills a result with 1 trial:" in caplog.text) == warned
    assert all(len(trial.commands.data) <= bound for trial in result.trials if trial.commands)


def test_another_seed_gives_other_actions(face_goals: FaceGoals) -> None:
    one, other = (face_goals("real_r", seed=seed, out=str(seed), n_trials=1) for seed in (0, 1))
    assert one.trials[0].actions_sha256 != other.trials[0].actions_sha256


def test_trials_are_independent_of_their_order(face_goals: FaceGoals, make_plan: MakePlan) -> None:
    controller = toy("tested:Changes")
    in_order = face_goals(controller).trials
    maker = TrialMaker(make_plan(controller))
    assert [maker.make(number)[0] for number in (3, 0, 3, 2)] == [
        in_order[number] for number in (3, 0, 3, 2)
    ]
    maker.close()


def test_learning_controller_meets_the_goals_in_order(face_goals: FaceGoals) -> None:
    learned = [face_goals(toy("tested:Learns"), jobs=jobs, out=f"{jobs}") for jobs in (1, 2)]
    assert scores(Path("1")) == scores(Path("2"))
    fresh = face_goals(toy("tested:Changes"), out="fresh")
    assert len({trial.actions_sha256 for trial in learned[0].trials}) == 4
    assert learned[0].trials[0] == fresh.trials[0]


@pytest.mark.parametrize("jobs", [1, 2])
def test_learning_across_trials_must_be_set_on_the_class(face_goals: FaceGoals, jobs: int) -> None:
    with pytest.raises(ControllerError, match="on the class"):
        face_goals(toy("tested:SaysThatItLearns"), jobs=jobs, n_trials=2)


def test_state_of_another_controller_is_not_loaded(play: Play, face_goals: FaceGoals) -> None:
    run = play(toy("series:Macros"), 2000)
    other = toy("series:StepMacros")
    alone = face_goals(other, n_trials=1, trial_steps=100, out="alone.json")
    assert face_goals(other, run=run, n_trials=1, trial_steps=100).trials == alone.trials


def test_moved_and_edited_controller_is_not_tested_untrained_in_silence(
    play: Play, face_goals: FaceGoals, tmp_path: Path
) -> None:
    code = Path(toy("series:Macros").partition(":")[0]).read_text()
    for folder, more in (("a", ""), ("b", "# edited\n")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "series.py").write_text(code + more)
    run = play(f"{tmp_path}/a/series.py:Macros", 2000)
    moved = f"{tmp_path}/b/series.py:Macros"
    with pytest.raises(ControllerError, match="with different code: use --keep-learned"):
        face_goals(moved, run=run, n_trials=1, trial_steps=100)
    kept = face_goals(moved, run=run, n_trials=1, trial_steps=100, wanted="keep")
    assert kept.setting.learned is not None


def test_scores_follow_from_the_final_poses(face_goals: FaceGoals, goals: GoalSet) -> None:
    for trial, goal in zip(face_goals("real_r").trials, goals.goals, strict=True):
        ends = np.array(trial.final_poses)[:, :3]
        far = np.linalg.norm(ends - goal.final_poses[:, :3], axis=1)
        np.testing.assert_allclose(trial.distances, far)
        assert trial.score == pytest.approx(float((0.25 ** (far / 0.10)).sum()))
        assert trial.challenge == goal.challenge


def test_controller_handed_over_is_tested_like_one_from_the_file(
    play: Play, face_goals: FaceGoals, make_plan: MakePlan, scene: Scene
) -> None:
    controller, out = toy("series:Macros"), Path("handed.h5")
    phase = IntrinsicPhase(controller, Condition.parse("OM"), 1, scene, 3000, seed=0, out=out)
    player = phase.run(ignore)
    plan = make_plan(controller, run=out)
    handed = ExtrinsicPhase(plan, 4, Path("handed.json")).run(ignore, proxy=player)
    read = face_goals(controller, run=out)
    assert handed.trials == read.trials
    assert (
        read.trials[0].actions_sha256
        != face_goals(controller, out="unprepared").trials[0].actions_sha256
    )


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"n_trials": 0}, "trials must"),
        ({"n_trials": 5}, "trials must"),
        ({"jobs": 0}, "jobs must"),
        ({"seed": -1}, "seed must"),
        ({"trial_steps": 0}, "step"),
        ({"controller": "nobody"}, "real_r"),
    ],
)
def test_bad_test_options_are_refused(
    face_goals: FaceGoals, tmp_path: Path, change: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(RealBenchError, match=complaint):
        face_goals(**{"controller": "real_r", **change})
    assert list(tmp_path.iterdir()) == []


def test_no_plan_has_a_recording_that_does_not_fit(play: Play, make_plan: MakePlan) -> None:
    """Whoever makes it: a command, a table or a round."""
    run = play(toy("series:Macros"), 1000)
    make_plan("real_r", run=run).check_recording()
    with pytest.raises(RecordingError, match="its condition is OM, not OJ"):
        make_plan("real_r", "OJ", run=run).check_recording()
    with h5py.File(run, "r+") as file:
        file.attrs["control_version"] = 1
    with pytest.raises(RecordingError, match=r"this realbench has 2.* \(play again\)"):
        make_plan("real_r", run=run).check_recording()


@pytest.mark.parametrize(
    ("field", "change"),
    [
        ("controller", {"controller": toy("tested:Changes")}),
        ("seed", {"seed": 1}),
        ("trial_steps", {"trial_steps": 900}),
        ("condition", {"condition": "IM"}),
    ],
)
def test_result_of_another_test_cannot_be_resumed(
    face_goals: FaceGoals, field: str, change: dict[str, Any]
) -> None:
    settings: dict[str, Any] = {"controller": "real_r", "n_trials": 1, "trial_steps": 500}
    face_goals(**settings)
    before = Path("score.json").read_bytes()
    with pytest.raises(ResultError, match=field):
        face_goals(**{**settings, **change}, resume=True)
    assert Path("score.json").read_bytes() == before


def test_version_that_differs_is_named_when_a_test_is_resumed(face_goals: FaceGoals) -> None:
    result = face_goals("real_r", n_trials=1)
    versions = {**result.setting.versions, "numpy": "0.1"}
    earlier = result.setting.model_copy(update={"versions": versions})
    told = list(_differences(earlier, result.setting))
    assert told == [f"numpy (0.1 then, {result.setting.versions['numpy']} now)"]


def test_resumed_test_can_have_more_trials_but_not_fewer(face_goals: FaceGoals) -> None:
    whole = face_goals("real_r", out="whole.json", trial_steps=500)
    face_goals("real_r", n_trials=2, trial_steps=500)
    assert face_goals("real_r", n_trials=4, trial_steps=500, resume=True).trials == whole.trials
    assert scores(Path("score.json")) == scores(Path("whole.json"))
    with pytest.raises(ResultError, match="3 trials"):
        face_goals("real_r", n_trials=3, trial_steps=500, resume=True)


def test_part_of_the_goals_spans_classes_and_can_be_extended(
    face_goals: FaceGoals, goals: GoalSet
) -> None:
    """A test of two goals, resumed to three of the same set, is a test of three."""
    assert goals.classes == ("2D", "2D", "2.5D", "3D")
    two = face_goals("real_r", n_trials=2, trial_steps=300)
    assert two.setting.goal_numbers == tuple(trial.goal for trial in two.trials) == (0, 2)
    assert (two.setting.n_goals, two.is_finished, two.is_complete) == (4, True, False)
    assert two.share == "2 of 4 goals"
    three = face_goals("real_r", n_trials=3, trial_steps=300, resume=True)
    assert three.setting.goal_numbers == (0, 2, 3)
    assert three.trials[:2] == two.trials
    anew = face_goals("real_r", n_trials=3, trial_steps=300, out="anew.json")
    assert three.trials == anew.trials
    assert scores(Path("score.json")) == scores(Path("anew.json"))


@pytest.mark.parametrize("jobs", [1, 2])
def test_failing_trial_keeps_the_trials_before_it(face_goals: FaceGoals, jobs: int) -> None:
    controller = toy("tested:FailsOnce")
    with pytest.raises(ControllerError, match=r"tested\.py, line \d+: ValueError: no idea"):
        face_goals(controller, jobs=jobs)
    kept = load_result(Path("score.json"))
    assert len(kept.trials) >= (2 if jobs == 1 else 1)
    assert not kept.is_complete
    whole = face_goals(controller, out="whole.json")
    assert face_goals(controller, jobs=jobs, resume=True).trials == whole.trials


def test_exploding_physics_is_reported_with_its_goal(
    face_goals: FaceGoals, goals: GoalSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin = Task.begin

    def begin_and_explode(task: Task, goal: Goal | None = None, **options: Any) -> None:
        begin(task, goal, **options)
        if goal is goals.goals[2]:
            task.simulation.set_object_poses(np.full((1, 7), np.nan))

    monkeypatch.setattr(Task, "begin", begin_and_explode)
    with pytest.raises(PhysicsError, match=r"goal 2: the physics exploded between steps 0 and 0 "):
        face_goals("real_r", trial_steps=500)
    assert n_tested(Path("score.json")) == 2


def test_result_of_a_learning_controller_cannot_be_resumed(face_goals: FaceGoals) -> None:
    controller = toy("tested:Learns")
    result = face_goals(controller)
    cut = result.model_copy(update={"trials": result.trials[:2], "seconds": {}})
    cut.save(Path("score.json"))
    with pytest.raises(ResultError, match="--overwrite"):
        face_goals(controller, resume=True)


def command(goals_path: Path, jobs: int, controller: str = "tested:Waits") -> list[str]:
    test = ("extrinsic", "--controller", toy(controller), "--condition", "OM", "--scene", SCENE)
    return realbench(*test, "--goals", goals_path, "--jobs", jobs, "--resume", eager=True)


def n_tested(path: Path) -> int:
    return len(load_result(path).trials) if path.exists() else 0


@pytest.fixture(scope="session")
def uninterrupted(goals_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result of the real program."""
    folder = tmp_path_factory.mktemp("uninterrupted")
    (folder / "go").touch()
    finished = run(command(goals_path, jobs=2), folder)
    assert finished.returncode == 0, finished.stderr
    return folder / "score.json"


@LINUX
def test_killed_test_can_be_resumed_and_leaves_no_process(
    goals_path: Path, uninterrupted: Path, tmp_path: Path
) -> None:
    process = start(command(goals_path, jobs=2), tmp_path)
    wait_for(process, lambda: n_tested(tmp_path / "score.json") > 0)
    workers = children(process.pid)
    process.kill()
    process.wait()
    assert len(workers) >= 2
    wait_until(lambda: not any(map(is_alive, workers)))
    check_that_it_resumes(goals_path, uninterrupted, tmp_path)


@pytest.mark.parametrize("jobs", [1, 2])
def test_stopped_test_says_how_to_resume(
    goals_path: Path, uninterrupted: Path, tmp_path: Path, jobs: int
) -> None:
    process = start(command(goals_path, jobs), tmp_path, os.setsid)
    wait_for(process, lambda: n_tested(tmp_path / "score.json") > 0)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does, workers included
    (tmp_path / "go").touch()
    _, message = process.communicate()
    if jobs > 1 and process.returncode == 0:  # the trials under way were the last ones
        assert scores(tmp_path / "score.json") == scores(uninterrupted)
        return
    assert process.returncode == 130
    controller, message = message.splitlines()
    assert controller.startswith("controller: class Waits of ")
    assert "--resume" in message
    check_that_it_resumes(goals_path, uninterrupted, tmp_path)


@LINUX
def test_a_test_can_be_stopped_while_its_workers_start(goals_path: Path, tmp_path: Path) -> None:
    (tmp_path / "go").touch()
    process = start(command(goals_path, jobs=2), tmp_path, os.setsid)
    wait_for(process, lambda: len(children(process.pid)) >= 3)  # one of them counts resources
    os.killpg(process.pid, signal.SIGINT)
    try:
        _, message = process.communicate(timeout=40)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode == 130
    controller, message = message.splitlines()
    assert controller.startswith("controller: class Waits of ")
    assert "--resume" in message


def check_that_it_resumes(goals_path: Path, uninterrupted: Path, folder: Path) -> None:
    assert 0 < n_tested(folder / "score.json") < len(load_goal_set(goals_path))
    (folder / "go").touch()
    again = run(command(goals_path, jobs=1), folder)
    assert again.returncode == 0, again.stderr
    assert scores(folder / "score.json") == scores(uninterrupted)


def children(pid: int) -> list[int]:
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for task in tasks for child in task.read_text().split()]


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_dead_worker_is_reported_and_finished_trials_are_kept(
    goals_path: Path, tmp_path: Path
) -> None:
    died = run(command(goals_path, jobs=2, controller="tested:Dies"), tmp_path)
    assert died.returncode == 1
    assert died.stderr.splitlines()[1].startswith("realbench: error: a worker process died")
    assert died.stderr.count("\n") == 2
    assert "--resume" in died.stderr
    assert 0 < n_tested(tmp_path / "score.json") < 4
