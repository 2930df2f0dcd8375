from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

from real_bench.conditions import Condition
from real_bench.controller import Controller
from real_bench.controller_code.finding import find_controller
from real_bench.errors import ControllerError, RealBenchError
from real_bench.goal_sets import GoalSet, generate_goal_set
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.local import LocalBackend
from real_bench.phases.trial import TrialMaker, TrialPlan
from real_bench.real_x import Planner
from real_bench.recording import Experience, Recording
from real_bench.scoring.result import TrialResult
from real_bench.simulation import Scene
from real_bench.spaces import action_space, observation_space
from tests.recording.bench import edited_poses, ignore

RESTS = str(Path(__file__).with_name("rests.py"))
BOTH = pytest.mark.parametrize("controller", ["real_d", "real_t"])
OM = Condition.parse("OM")

Play = Callable[..., Path]
Face = Callable[..., tuple[TrialResult, ...]]


@pytest.fixture(scope="module")
def play(builtin_scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Play:
    """Run an intrinsic phase; gives the recording."""

    def play(
        controller: str, steps: int, condition: str = "OM", objects: int = 1, **options: Any
    ) -> Path:
        out = options.get("out") or tmp_path_factory.mktemp("run") / "run.h5"
        kind = Condition.parse(condition)
        phase = IntrinsicPhase(controller, kind, objects, builtin_scene, steps, seed=2, out=out)
        phase.run(ignore, resume="out" in options)
        return out

    return play


@pytest.fixture(scope="module")
def run(play: Play) -> Path:
    """Free play of eight actions."""
    return play("real_d", 8000)


@pytest.fixture(scope="module")
def mover(run: Path) -> int:
    """The number of the action that moved the object farthest."""
    with Recording(run) as recording:
        far = recording.displacements()[:, 0]
    assert far.max() > 0.06
    return int(far.argmax())


@pytest.fixture(scope="module")
def goals(builtin_scene: Scene) -> GoalSet:
    return generate_goal_set(builtin_scene, 1, seed=5, counts={"2D": 1})


@pytest.fixture(scope="module")
def goal_of_the_mover(run: Path, mover: int, goals: GoalSet) -> GoalSet:
    """From where an action of free play found the object to where it left it."""
    with Recording(run) as recording:
        rows, poses = recording.transitions[mover], recording.object_poses
    before, after = poses[rows["precondition"]], poses[rows["outcome"]]
    goal = replace(goals.goals[0], initial_poses=before, final_poses=after)
    return replace(goals, goals=(goal,))


@pytest.fixture
def face(builtin_scene: Scene, goals: GoalSet, tmp_path: Path) -> Face:
    """Run a short extrinsic phase; gives its trials."""

    def face(
        controller: str,
        run: Path | None = None,
        goal_set: GoalSet = goals,
        condition: str = "OM",
        steps: int = 1000,
        **options: Any,
    ) -> tuple[TrialResult, ...]:
        kind = Condition.parse(condition)
        plan = TrialPlan(
            controller, kind, builtin_scene, goal_set, 0, trial_steps=steps, run=run, **options
        )
        phase = ExtrinsicPhase(plan, len(goal_set), tmp_path / "score.json")
        return phase.run(ignore, overwrite=True).trials

    return face


@pytest.fixture(scope="module")
def at_rest(builtin_scene: Scene, goals: GoalSet) -> tuple[TrialResult, ...]:
    """What comes of doing nothing."""
    maker = TrialMaker(TrialPlan(RESTS, OM, builtin_scene, goals, 0, trial_steps=1000))
    trials = tuple(maker.make(number)[0] for number in range(len(goals)))
    maker.close()
    return trials


def made(controller: str, scene: Scene, run: Path, condition: str = "OM") -> Controller:
    """A controller that has seen a recording, about to begin a trial."""
    kind = find_controller(controller)
    parsed = Condition.parse(condition)
    spaces = action_space(scene, parsed), observation_space(scene, parsed, 1)
    ready: Controller = kind(*spaces, kind.Settings())
    ready.use_experience(Experience(run, parsed))
    ready.start_extrinsic_phase()
    ready.start_extrinsic_trial()
    return ready


def seen(here: NDArray[np.float64], goal: NDArray[np.float64]) -> dict[str, Any]:
    """What an observation of one object says of positions."""
    return {"object_positions": {"cube": here}, "goal_positions": {"cube": goal}}


@BOTH
def test_action_that_made_the_change_before_is_repeated(
    builtin_scene: Scene, run: Path, mover: int, controller: str
) -> None:
    experience = Experience(run, OM)
    before, after = experience.positions_before()[mover, 0], experience.positions_after()[mover, 0]
    ready = made(controller, builtin_scene, run)
    action, wanted = ready.next_action(seen(before, after)), experience.action(mover)
    np.testing.assert_array_equal(action.commands, wanted.commands)
    np.testing.assert_array_equal(action.n_steps, wanted.n_steps)
    assert np.isnan(ready.next_action(seen(after, after)).commands).all()


@BOTH
def test_goal_within_one_known_action_is_reached(
    face: Face, run: Path, goal_of_the_mover: GoalSet, controller: str
) -> None:
    (trial,) = face(controller, run, goal_of_the_mover, steps=1500)
    assert trial.distances[0] < 0.02  # it began more than 0.06 away


@BOTH
@pytest.mark.parametrize(("depth", "expected"), [(3, [3, 3, 3, 3]), (10, [10, 9, 8, 7])])
def test_replans_after_every_action_for_the_rest_of_the_trial(
    face: Face,
    run: Path,
    monkeypatch: pytest.MonkeyPatch,
    controller: str,
    depth: int,
    expected: list[int],
) -> None:
    depths, plan = [], Planner.plan

    def spy(planner: Planner, state: Any, goal: Any, depth: int) -> Any:
        depths.append(depth)
        return plan(planner, state, goal, depth)

    monkeypatch.setattr(Planner, "plan", spy)
    face(controller, run, steps=3500, settings={"planner": {"depth": depth}}, wanted="keep")
    assert depths == expected


@BOTH
def test_trials_do_not_depend_on_earlier_ones(
    face: Face,
    builtin_scene: Scene,
    run: Path,
    goals: GoalSet,
    goal_of_the_mover: GoalSet,
    controller: str,
) -> None:
    two = replace(goals, goals=goal_of_the_mover.goals + goals.goals)
    in_order = face(controller, run, two)
    plan = TrialPlan(controller, OM, builtin_scene, two, 0, trial_steps=1000, run=run)
    maker = TrialMaker(plan)
    assert [maker.make(number)[0] for number in (1, 0, 0)] == [
        in_order[number] for number in (1, 0, 0)
    ]
    maker.close()


def keep(file: h5py.File, rows: list[int]) -> None:
    """Make a recording one of these actions only, which must be macros."""
    transitions, commands = file["transitions"][()][rows], file["commands"][()][rows]
    seen = np.ravel([transitions["precondition"], transitions["outcome"]], "F")
    transitions["first_command"] = np.arange(len(rows))
    transitions["first_step"] = np.cumsum(transitions["n_steps"]) - transitions["n_steps"]
    transitions["precondition"] = 2 * np.arange(len(rows))
    transitions["outcome"] = transitions["precondition"] + 1
    contents = {"transitions": transitions, "commands": commands}
    contents |= {name: file[name][()][seen] for name in ("states", "ground_truth/object_poses")}
    for name, kept in contents.items():
        file[name].resize(len(kept), axis=0)
        file[name][:] = kept
    file.attrs["n_steps"] = transitions["n_steps"].sum()


def stand_still(file: h5py.File) -> None:
    with edited_poses(file) as poses:
        poses[:] = poses[0]


def changed(run: Path, folder: Path, change: Callable[[h5py.File], None]) -> Path:
    path = folder / "changed.h5"
    shutil.copy(run, path)
    with h5py.File(path, "r+") as file:
        change(file)
    return path


@BOTH
def test_path_is_followed_action_by_action(
    builtin_scene: Scene, run: Path, tmp_path: Path, controller: str
) -> None:
    way = np.append(0.0, np.cumsum(0.1 - 0.01 * np.arange(8)))[:, None] * [1, 1, 0]

    def lay(file: h5py.File) -> None:
        with edited_poses(file) as poses:
            poses[:, 0, :3] = way

    laid = changed(run, tmp_path, lay)
    ready, experience = made(controller, builtin_scene, laid), Experience(laid, OM)
    for number in range(1, 5):
        action = ready.next_action(seen(way[number] + 0.001, way[5]))
        np.testing.assert_array_equal(action.commands, experience.action(number).commands)
    assert np.isnan(ready.next_action(seen(way[5] + 0.001, way[5])).commands).all()


@BOTH
@pytest.mark.parametrize("experience", ["none", "one", "alike", "without effect"])
def test_useless_experience_makes_it_rest(
    face: Face,
    at_rest: tuple[TrialResult, ...],
    run: Path,
    mover: int,
    tmp_path: Path,
    controller: str,
    experience: str,
) -> None:
    changes: dict[str, Callable[[h5py.File], None]] = {
        "none": lambda file: keep(file, []),
        "one": lambda file: keep(file, [mover]),
        "alike": lambda file: keep(file, [mover] * 5),
        "without effect": stand_still,
    }
    poor = changed(run, tmp_path, changes[experience])
    assert face(controller, poor) == at_rest


@pytest.mark.parametrize("experience", ["one", "alike"])
def test_real_d_cannot_use_an_action_without_others_to_compare(
    face: Face,
    run: Path,
    mover: int,
    goal_of_the_mover: GoalSet,
    tmp_path: Path,
    experience: str,
) -> None:
    """Its effect is as large as every threshold, and counts only where it is larger."""
    rows = [mover] * (1 if experience == "one" else 5)
    poor = changed(run, tmp_path, lambda file: keep(file, rows))
    assert face("real_d", poor, goal_of_the_mover) == face(RESTS, None, goal_of_the_mover)
    done = face("real_t", poor, goal_of_the_mover)  # which has thresholds of its own
    assert done[0].distances[0] < 0.02


@pytest.mark.parametrize("condition", ["OJ", "OC"])
def test_it_rests_with_every_control(
    face: Face, play: Play, tmp_path: Path, condition: str
) -> None:
    still = changed(play("real_d", 2000, condition), tmp_path, stand_still)
    one = face("real_d", still, condition=condition, steps=1000)
    assert one == face(RESTS, condition=condition, steps=1000)


@BOTH
@pytest.mark.parametrize("number", [np.nan, np.inf])
def test_non_finite_positions_are_refused_before_any_trial(
    face: Face, run: Path, tmp_path: Path, controller: str, number: float
) -> None:
    def spoil(file: h5py.File) -> None:
        with edited_poses(file) as poses:
            poses[3, 0, 1] = number

    with pytest.raises(ControllerError, match=rf"{controller}: 2 of 8 triplets .* not finite"):
        face(controller, changed(run, tmp_path, spoil))
    assert not (tmp_path / "score.json").exists()


@BOTH
def test_planning_without_a_recording_is_refused(
    face: Face, tmp_path: Path, controller: str
) -> None:
    with pytest.raises(ControllerError, match=f"{controller}: .*--run"):
        face(controller)
    assert not (tmp_path / "score.json").exists()


def test_real_t_is_refused_where_it_sees_no_positions(
    face: Face, play: Play, tmp_path: Path
) -> None:
    """Its thresholds are metres."""
    images = play("real_r", 1000, "IM")
    with pytest.raises(ControllerError, match=r"real_t: .*use an O condition"):
        face("real_t", images, condition="IM")
    assert not (tmp_path / "score.json").exists()


@pytest.mark.parametrize("condition", ["OM", "OJ", "OC"])
def test_planners_play_like_real_r(play: Play, condition: str) -> None:
    runs = []
    for controller in ("real_r", "real_d", "real_t"):
        with Recording(play(controller, 1200, condition)) as recording:
            runs.append((recording.commands(), recording.object_poses))
    for commands, poses in runs[1:]:
        np.testing.assert_array_equal(commands, runs[0][0])
        np.testing.assert_array_equal(poses, runs[0][1])


def test_resumed_play_matches_an_uninterrupted_one(play: Play, run: Path, tmp_path: Path) -> None:
    for steps in (1000, 3000):
        play("real_d", steps, out=tmp_path / "cut.h5")
    with Recording(tmp_path / "cut.h5") as cut, Recording(run) as whole:
        assert cut.cuts == [1000]
        np.testing.assert_array_equal(cut.commands(), whole.commands()[: cut.n_commands])


def test_states_are_the_positions_of_all_objects(
    builtin_scene: Scene, play: Play, face: Face
) -> None:
    run = play("real_d", 2000, objects=2)
    two = generate_goal_set(builtin_scene, 2, seed=1, counts={"2D": 1})
    states, plan = [], Planner.plan

    def spy(planner: Planner, *arguments: Any) -> Any:
        states.append(np.concatenate(arguments[:2]))
        return plan(planner, *arguments)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Planner, "plan", spy)
        face("real_d", run, two, steps=1000)
    goal = two.goals[0]
    np.testing.assert_allclose(states[0][:4], goal.initial_poses[:, :2].reshape(-1), atol=1e-6)
    np.testing.assert_allclose(states[0][4:], goal.final_poses[:, :2].reshape(-1), atol=1e-12)


def test_cut_action_is_not_used_for_planning(builtin_scene: Scene, play: Play) -> None:
    ready: Any = made("real_d", builtin_scene, play("real_d", 4500))
    assert ready._planner is not None
    assert len(ready._planner.triplets) == 4


def test_real_ld_records_the_images_that_it_learns_from(builtin_scene: Scene) -> None:
    identity = LocalBackend().identity("real_ld", {})
    assert identity.uses_images
    facts = ("real_ld", OM, 1, builtin_scene, 1000, 0, Path("run.h5"))
    assert IntrinsicPhase(*facts)._header(identity).images
    with pytest.raises(RealBenchError, match="learns from images"):
        IntrinsicPhase(*facts, images=False)._header(identity)
