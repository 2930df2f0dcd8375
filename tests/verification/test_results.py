"""Results: the honest verify, the others do not."""

from __future__ import annotations

import dataclasses
import json
import re
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from real_bench.actions import Action
from real_bench.errors import ControllerError, Interrupted, RealBenchError, ResultError
from real_bench.goal_sets import GoalSet, save_goal_set
from real_bench.scoring.commands import Commands
from real_bench.scoring.result import Result, load_result
from real_bench.simulation import HOME, Scene, Simulation
from real_bench.verification import ResultVerdict, ResultVerification
from real_bench.verification.differences import ROUNDING
from tests.phases.conftest import toy
from tests.verification.conftest import MakeResult, altered, forged, play

EVALUATION = Path(__file__).parents[2] / "evaluation"

NOT_PROVED = re.compile(
    r"setting\.(controller|controller_sha256|run_sha256|run_steps|seed|versions\..*|settings\..*)"
    r"|timing\.seconds\..*"
)
"""What a forger may change who seals the file anew; docs/verification.md says so."""


def verify(path: Path, goals_path: Path, **options: Any) -> ResultVerdict:
    return ResultVerification(path, goals_path, **options).verify(ignore_two)


def ignore_two(done: int, total: int) -> None:
    assert 0 <= done <= total


def test_an_honest_result_verifies(honest: Path, goals_path: Path) -> None:
    verdict = verify(honest, goals_path)
    assert verdict.holds
    assert [check.goal for check in verdict.checks] == [0, 1]
    assert verdict.score == load_result(honest).score
    assert verdict.lines()[-1].startswith("verified: 2 of 2 trials replay bit for bit, score 0.")


@pytest.mark.parametrize(
    ("controller", "condition"),
    [
        ("real_r", "OJ"),  # lines between via points
        (toy("series:StepMacros"), "OM"),
        (toy("tested:GlobalRandomness"), "OJ"),  # another command at every step
        ("real_r", "OC"),
    ],
)
def test_every_control_verifies(
    make_result: MakeResult, goals_path: Path, controller: str, condition: str
) -> None:
    path = make_result(controller, condition, n_trials=1, trial_steps=1500)
    assert verify(path, goals_path).holds


def test_processes_and_other_simulations_change_nothing(
    make_result: MakeResult, goals_path: Path, builtin_scene: Scene
) -> None:
    path = make_result(n_trials=3)
    with Simulation(builtin_scene, 3) as first, Simulation(builtin_scene, 2) as second:
        first.hold(HOME, 300)
        second.hold([0.3] * 9, 300)
        alone = verify(path, goals_path)
        shared = verify(path, goals_path, jobs=2)
    assert alone.holds
    assert alone == shared


def test_recording_it_learned_from_is_checked(
    builtin_scene: Scene, make_result: MakeResult, goals_path: Path, tmp_path: Path
) -> None:
    run = play(builtin_scene, tmp_path / "run.h5", 3000)
    other = play(builtin_scene, tmp_path / "other.h5", 2000)
    path = make_result("real_d", n_trials=1, run=run)
    assert "give it with --run" in " ".join(verify(path, goals_path).notes)
    checked = verify(path, goals_path, run=run)
    assert checked.holds
    assert "--run" not in " ".join(checked.notes)
    wrong = verify(path, goals_path, run=other)
    assert not wrong.holds
    assert [fault.rpartition(": ")[2] for fault in wrong.faults] == [
        "its hash differs",
        "it has 2,000 steps, not 3,000",
    ]


def test_the_controller_is_checked_and_not_run(
    honest: Path,
    make_result: MakeResult,
    goals_path: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)  # a result names no folder
    source = Path(toy("series:Macros").partition(":")[0]).read_text()
    (tmp_path / "mine.py").write_text(source)
    spec = f"{tmp_path / 'mine.py'}:Macros"
    path = make_result(spec, n_trials=1)
    assert verify(path, goals_path).holds
    assert verify(path, goals_path, controller=spec).holds
    (tmp_path / "mine.py").write_text(source + "\nraise SystemExit\n")
    assert "not the one that was tested" in " ".join(verify(path, goals_path).notes)
    asked = verify(path, goals_path, controller=spec)
    assert not asked.holds
    assert "not the one that was tested" in asked.faults[0]
    (tmp_path / "mine.py").unlink()
    assert "not found, so its hash was not checked" in " ".join(verify(path, goals_path).notes)
    with pytest.raises(ControllerError, match="controller file not found"):
        verify(path, goals_path, controller=spec)
    assert not verify(honest, goals_path, controller="real_d").holds
    assert verify(honest, goals_path, controller="real_r").holds


def leaves(content: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where every number and text of a file is, but for the seals."""
    if isinstance(content, dict | list):
        for key in content if isinstance(content, dict) else range(len(content)):
            yield from leaves(content[key], (*place, key))
    elif place[-1] != "seal":
        yield place


def something_else(value: Any) -> Any:
    if isinstance(value, bool) or value is None:
        return not value
    if isinstance(value, int):
        return value + 1
    return float(np.nextafter(value, 9)) if isinstance(value, float) else f"{value}0"


DERIVED = {"score", "distance", "distances", "summary"}
"""Their last bits depend on the processor."""


def as_little_as_counts(place: tuple[Any, ...]) -> Callable[[Any], Any]:
    """What changes a fact by its last bit, and what is derived by more than rounding would."""

    def changed(value: Any) -> Any:
        rounded = isinstance(value, float) and not DERIVED.isdisjoint(place)
        return value + 2 * ROUNDING if rounded else something_else(value)

    return changed


def test_resealed_forgery_is_found_by_the_replay(honest: Path, goals_path: Path) -> None:
    """Every number and text but those that no replay can prove, changed by as little as can be."""
    content = json.loads(honest.read_text())
    content["setting"]["versions"] = {"python": "3.11"}  # one will do
    places = list(leaves(content))
    unproved = set()
    for place in places:
        try:
            verdict = verify(altered(honest, place, as_little_as_counts(place)), goals_path)
        except RealBenchError:
            continue
        if verdict.holds:
            unproved.add(".".join(map(str, place)))
    assert len(places) > 45
    assert [name for name in unproved if not NOT_PROVED.fullmatch(name)] == []
    assert unproved  # else the documents are wrong


def test_a_broken_seal_does_not_verify(honest: Path, goals_path: Path) -> None:
    content = json.loads(honest.read_text())
    content["timing"]["seconds"]["0"] += 1
    forgery = honest.with_name("unsealed.json")
    forgery.write_text(json.dumps(content))
    verdict = verify(forgery, goals_path)
    assert not verdict.different
    assert verdict.lines()[-1].startswith(
        "does not verify: the trials replay bit for bit, but the file was altered"
    )


def moved(result: Result, goal: int, metres: float) -> Result:
    """A result in which a trial ended a bit farther along x, and all that follows from that."""
    trials = list(result.trials)
    pose = np.array(trials[goal].final_poses)
    pose[0, 0] += metres
    trials[goal] = trials[goal].model_copy(update={"final_poses": (tuple(pose[0].tolist()),)})
    return result.model_copy(update={"trials": tuple(trials)})


def test_first_differing_goal_is_reported_with_its_difference(
    honest: Path, goals_path: Path
) -> None:
    result = load_result(honest)
    forgery = forged(honest, moved(moved(result, 1, 0.25), 1, 0.25).to_json())
    verdict = verify(forgery, goals_path)
    assert [check.goal for check in verdict.different] == [1]
    assert verdict.lines()[-1] == (
        "does not verify: 1 of 2 trials differ, first goal 1: position of cube differs by 0.5 m"
    )
    assert verdict.to_json()["first_difference"]["differences"][0]["by"] == pytest.approx(0.5)


def with_commands(result: Result, goal: int, commands: Commands) -> Result:
    trials = list(result.trials)
    hashed = {"commands": commands, "actions_sha256": commands.sha256}
    trials[goal] = trials[goal].model_copy(update=hashed)
    return result.model_copy(update={"trials": tuple(trials)})


def test_swapped_commands_are_found_by_the_replay(honest: Path, goals_path: Path) -> None:
    result = load_result(honest)
    other = Commands.of([Action.macro([[-0.1, 0.3], [-0.1, -0.3]]).first(800)])
    verdict = verify(forged(honest, with_commands(result, 1, other).to_json()), goals_path)
    assert [check.goal for check in verdict.different] == [1]


@pytest.mark.parametrize(
    ("commands", "complaint"),
    [
        (Commands.of([Action.rest(9, 800)]), r"shape \(k, 4\)"),
        (Commands.of([Action(np.zeros((1, 4)), np.array([800]), np.array([True]))]), "straight"),
    ],
)
def test_commands_of_another_control_are_reported(
    honest: Path, goals_path: Path, commands: Commands, complaint: str
) -> None:
    result = load_result(honest)
    verdict = verify(forged(honest, with_commands(result, 0, commands).to_json()), goals_path)
    assert re.search(complaint, str(verdict.checks[0]))
    assert verdict.checks[1].differences == ()


def test_a_trial_that_began_elsewhere_is_found(
    make_result: MakeResult, goals: GoalSet, goals_path: Path, honest: Path
) -> None:
    """Tested from starts nearer to the goals, and then said to be of the true ones."""
    aside = np.array([0.02, 0, 0, 0, 0, 0, 0])
    near = tuple(
        dataclasses.replace(goal, initial_poses=goal.final_poses + aside) for goal in goals.goals
    )
    path = make_result(goal_set=dataclasses.replace(goals, goals=near))
    assert load_result(path).score > load_result(honest).score
    verdict = verify(altered(path, ("setting", "goals_sha256"), lambda _: goals.sha256), goals_path)
    assert len(verdict.different) == 2


def test_altered_goals_are_refused(
    honest: Path, goals: GoalSet, tmp_path: Path, goals_path: Path
) -> None:
    poses = goals.goals[2].final_poses.copy()
    poses[0, 0] = np.nextafter(poses[0, 0], 9)
    others = (*goals.goals[:2], dataclasses.replace(goals.goals[2], final_poses=poses))
    save_goal_set(dataclasses.replace(goals, goals=others), tmp_path / "goals.npy")
    with pytest.raises(ResultError, match="give its goals with --goals"):
        verify(honest, tmp_path / "goals.npy")
    assert verify(honest, goals_path).holds


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"goals": None}, "not on the shipped ones"),
        ({"jobs": 0}, "jobs must be a whole number of at least 1, not 0"),
        ({"path": EVALUATION / "results" / "real_r-OM-1.json"}, "it keeps no commands"),
        (
            {"path": EVALUATION / "results/earlier-control/real_r-IM-1-seed0-shipped.json"},
            "cannot be replayed: its macro-actions have version 1, this realbench has 2",
        ),
        ({"path": EVALUATION / "README.md"}, "cannot be read"),
        ({"scene": "moon"}, "unknown scene"),
    ],
)
def test_results_that_cannot_be_replayed_are_refused(
    honest: Path, goals_path: Path, options: dict[str, Any], complaint: str
) -> None:
    wanted = {"path": honest, "goals": goals_path, **options}
    with pytest.raises(RealBenchError, match=complaint) as caught:
        ResultVerification(**wanted).verify(ignore_two)
    assert "\n" not in str(caught.value)


def test_another_scene_is_refused(honest: Path, goals_path: Path, official_scene: Scene) -> None:
    with pytest.raises(ResultError, match=r"is of scene builtin .* not of this official"):
        verify(honest, goals_path, scene=official_scene.source)


def test_a_result_without_trials_is_refused(honest: Path, goals_path: Path) -> None:
    empty = load_result(honest).model_copy(update={"trials": (), "seconds": {}})
    with pytest.raises(ResultError, match="no trial yet"):
        verify(forged(honest, empty.to_json()), goals_path)


def test_an_incomplete_result_passes_only_when_asked(honest: Path, goals_path: Path) -> None:
    result = load_result(honest)
    part = result.model_copy(update={"trials": result.trials[:1], "seconds": {}})
    path = forged(honest, part.to_json())
    verdict = verify(path, goals_path)
    assert not verdict.holds
    assert "incomplete, 1 of 2 trials; these replay" in verdict.lines()[-1]
    assert verify(path, goals_path, may_be_incomplete=True).holds


def test_hand_picked_part_of_the_goals_does_not_verify(
    make_result: MakeResult, honest: Path, goals_path: Path
) -> None:
    """A part is spread over the classes by rule: nobody picks the goals that went well."""
    whole = load_result(make_result(n_trials=3))
    for chosen in ((1,), (0, 2), (1, 2)):
        part = whole.model_copy(
            update={
                "setting": whole.setting.model_copy(update={"goal_numbers": chosen}),
                "trials": tuple(whole.trials[goal] for goal in chosen),
                "seconds": {},
            }
        )
        verdict = verify(forged(honest, part.to_json()), goals_path)
        assert not verdict.holds
        assert "are not those that a test of" in verdict.faults[0]
    assert "only 2 of 3 goals were asked for" in verify(honest, goals_path).notes


def test_other_versions_are_noted(honest: Path, goals_path: Path) -> None:
    place = ("setting", "versions", "pybullet")
    verdict = verify(altered(honest, place, lambda _: "3.0.0 by me"), goals_path)
    assert "pybullet was 3.0.0 by me, here it is" in verdict.notes[0]
    assert verdict.holds
    with pytest.raises(ResultError, match="a name must be printable"):
        verify(altered(honest, place, lambda _: "3.0.0\nby me"), goals_path)


def test_kind_of_observation_is_not_proved(honest: Path, goals_path: Path) -> None:
    """The same commands might have been chosen from images; docs/verification.md says so."""
    assert verify(altered(honest, ("setting", "condition"), lambda _: "IM"), goals_path).holds
    joints = altered(honest, ("setting", "condition"), lambda _: "OJ")
    with pytest.raises(ResultError, match="its joints have version 2, this realbench has 1"):
        verify(joints, goals_path)
    assert not verify(
        altered(joints, ("setting", "control_version"), lambda _: 1), goals_path
    ).holds


@pytest.mark.parametrize("jobs", [1, 2])
def test_verification_can_be_stopped(make_result: MakeResult, goals_path: Path, jobs: int) -> None:
    path = make_result(n_trials=3)

    def press_ctrl_c(done: int, total: int) -> None:
        if done == 1:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Interrupted, match=r"stopped after [12] of 3 trials"):
        ResultVerification(path, goals_path, jobs=jobs).verify(press_ctrl_c)


def test_progress_is_reported(honest: Path, goals_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    ResultVerification(honest, goals_path).verify(lambda done, total: seen.append((done, total)))
    assert seen == [(0, 2), (1, 2), (2, 2)]


def test_last_bit_of_a_derived_value_is_ignored(honest: Path, goals_path: Path) -> None:
    """As another machine wrote it: a distance whose last bit is another one."""
    content = json.loads(honest.read_text())
    for row in content["trials"]:
        row["distances"] = [float(np.nextafter(each, 9)) for each in row["distances"]]
    verdict = verify(forged(honest, content), goals_path)
    assert verdict.holds, verdict.lines()


def test_last_bit_of_a_pose_is_checked(honest: Path, goals_path: Path) -> None:
    content = json.loads(honest.read_text())
    pose = content["trials"][0]["final_poses"][0]
    pose[0] = float(np.nextafter(pose[0], 9))
    verdict = verify(forged(honest, content), goals_path)
    assert not verdict.holds
    assert str(verdict.different[0].differences[0]).startswith("position of cube differs by")
