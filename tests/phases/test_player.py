"""Controllers of both kinds at play, and what happens when they go wrong."""

from __future__ import annotations

import inspect
import json
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from real_bench.conditions import CONDITION_NAMES, Condition
from real_bench.controller_code.finding import find_controller
from real_bench.errors import ControllerError, RecordingError
from real_bench.goal_sets import GoalSet
from real_bench.recording import Recording
from real_bench.simulation import Scene
from real_bench.task import Task
from tests.phases.conftest import FaceGoals, Play, toy
from tests.recording.bench import recorded_steps

RAISE = [
    "Raises",
    "Exits",
    "FailsInALibrary",
    "Recurses",
    "StepRaises",
    "StepExits",
    "MakesABadAction",
    "ReadsThePast",
]
RETURN = [
    "GivesNone",
    "GivesADict",
    "GivesNaN",
    "GivesInfinity",
    "GivesTooMany",
    "GivesALine",
    "StepGivesNone",
    "StepGivesNaN",
    "StepGivesTooFew",
    "StepGivesAnotherKey",
    "StepGivesText",
    "StepGivesTooLargeNumbers",
    "StepGivesRaggedRender",
    "StepGivesATensorThatNeedsGradients",
]


def complaint(play: Play, controller: str, steps: int = 3500) -> str:
    with pytest.raises(ControllerError) as caught:
        play(controller, steps)
    message = str(caught.value)
    assert "\n" not in message
    assert controller in message
    return message


@pytest.mark.parametrize("name", RAISE)
def test_controller_errors_are_reported_with_file_and_line(play: Play, name: str) -> None:
    controller = toy(f"faulty:{name}")
    _, first_line = inspect.getsourcelines(find_controller(controller).go_wrong)
    file = controller.rpartition(":")[0]
    assert f"{file}, line {first_line + 1}: " in complaint(play, controller)


@pytest.mark.parametrize("name", RETURN)
def test_bad_actions_are_reported(play: Play, name: str) -> None:
    told = complaint(play, toy(f"faulty:{name}"))
    assert "returned a bad action" in told or "ActionError: a command must be finite" in told


@pytest.mark.parametrize(
    ("name", "done", "steps"), [("Raises", 2000, 3000), ("StepRaises", 1000, 2400)]
)
def test_actions_before_a_fault_are_kept_and_resumed(
    play: Play, name: str, done: int, steps: int
) -> None:
    controller = toy(f"faulty:{name}")
    complaint(play, controller, steps)
    kept = recorded_steps(Path("run.h5"))
    assert 0 < kept <= done
    with Recording(play(controller, steps, resume=True)) as recording:
        assert recording.n_steps == steps
        assert recording.cuts == [kept]


@pytest.mark.parametrize(
    "name",
    [
        "StateIsNoDict",
        "StateFails",
        "StateCannotBeKept",
        "StateCannotBeCopied",
    ],
)
def test_bad_state_is_reported(play: Play, name: str) -> None:
    with pytest.raises((ControllerError, RecordingError)) as caught:
        play(toy(f"faulty:{name}"), 1000)
    assert "\n" not in str(caught.value)
    assert "controller" in str(caught.value)


def test_a_controller_needs_nothing_but_step(play: Play) -> None:
    with Recording(play(toy("faulty:NoBasePolicy"), 1000)) as recording:
        assert recording.n_steps == 1000


def met() -> list[dict[str, Any]]:
    """What the witness wrote down."""
    return [json.loads(line) for line in Path("met.jsonl").read_text().splitlines()]


def check_calls(calls: list[dict[str, Any]]) -> None:
    """``done`` comes with the end, and images come with the step after they were asked for."""
    observed = [call for call in calls if "keys" in call]
    assert all(call["reward"] == 0 for call in observed)
    assert all(call["done"] == call["hook"].startswith("end_") for call in observed)
    assert all(call["listed"] for call in observed)
    asked = [True, *[call["asked"] for call in observed[1:]]]
    assert [call["sees"] for call in observed] == asked
    assert all(call["depth"] == ("float32" if call["sees"] else "float64") for call in observed)


@pytest.mark.parametrize("condition", ["OJ", "IJ"])
def test_official_controller_gets_the_official_calls_in_play(play: Play, condition: str) -> None:
    play(toy("official:Witness"), 8, condition=condition)
    calls = met()
    assert [call["hook"] for call in calls] == [
        "__init__",
        "start_intrinsic_phase",
        *["step"] * 8,
        "end_intrinsic_phase",
    ]
    check_calls(calls)
    told = set(calls[2]["keys"])
    official = {"joint_positions", "touch_sensors", "retina", "goal"}
    positions = {"mask", "goal_mask", "object_positions", "goal_positions"}
    assert official <= told
    assert told & positions == (positions if condition == "OJ" else set())
    assert not any(call["sees_goal"] or call["masks_goal"] for call in calls if "keys" in call)
    assert not any(call["goal_positions"] for call in calls if "keys" in call)


def test_official_controller_gets_the_official_calls_in_tests(
    face_goals: FaceGoals, goals: GoalSet
) -> None:
    tested = face_goals(toy("official:Witness"), condition="OJ", n_trials=2, trial_steps=7)
    calls = met()
    trial = ["start_extrinsic_trial", *["step"] * 7, "end_extrinsic_trial"]
    assert [call["hook"] for call in calls] == [
        *("__init__", "start_extrinsic_phase"),
        *(*trial, *trial),
        "end_extrinsic_phase",
    ]
    for number, trial_result in enumerate(tested.trials):
        first, *rest = calls[3 + 9 * number :][:8]
        check_calls([first, *rest])
        goal = goals.goals[trial_result.goal]
        assert {call["goal"] for call in (first, *rest)} == {
            sha256(goal.retina.tobytes()).hexdigest()
        }
        name = goals.object_names[0]
        np.testing.assert_allclose(first["positions"][name], goal.initial_poses[0, :3], atol=1e-9)
        np.testing.assert_array_equal(first["goal_positions"][name], goal.final_poses[0, :3])


@pytest.mark.parametrize("condition", CONDITION_NAMES)
def test_unread_parts_of_an_old_observation_raise(scene: Scene, condition: str) -> None:
    task = Task(scene, Condition.parse(condition), 2)
    task.begin()
    seen = task.observe()
    joints, image = seen["joint_positions"].copy(), seen["retina"].copy()
    task.simulation.hold([0.3] * 9, 20)
    task.step(np.full(task.control.size, np.nan))  # go home
    np.testing.assert_array_equal(seen["joint_positions"], joints)
    np.testing.assert_array_equal(seen["retina"], image)
    assert not np.array_equal(task.observe()["joint_positions"], joints)
    for key in set(seen) - {"joint_positions", "retina"}:
        with pytest.raises(ControllerError, match=key):
            seen[key]
    with pytest.raises(KeyError):
        seen["score"]
    task.close()
