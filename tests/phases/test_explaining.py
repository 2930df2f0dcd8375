from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from real_bench.conditions import Condition
from real_bench.errors import ControllerError, RealBenchError
from real_bench.goal_sets import GoalSet
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.recording import Recording
from real_bench.simulation import Scene
from tests.phases.conftest import FaceGoals
from tests.recording.bench import ignore

PLANNING = {"condition": "OM", "n_trials": 2, "trial_steps": 2500}
EXPLAINS_ODDLY = """
from real_bench.actions import Action
from real_bench.controller import Controller, Explanation

class Oddly(Controller):
    def next_action(self, observation):
        return Action.rest(4)
    def explain(self):
        return {answer}
"""


@pytest.fixture(scope="module")
def run(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A play of twelve pushes."""
    out = tmp_path_factory.mktemp("played") / "run.h5"
    IntrinsicPhase("real_d", Condition.parse("OM"), 1, scene, 12_000, 0, out).run(ignore)
    return out


def test_explaining_changes_no_score(face_goals: FaceGoals, run: Path) -> None:
    explained = face_goals("real_d", run=run, explanations=Path("why"), **PLANNING)
    plain = face_goals("real_d", run=run, out="plain.json", **PLANNING)
    assert explained.trials == plain.trials
    assert sorted(path.name for path in Path("why").iterdir()) == [
        f"trial-{number:02d}.{kind}"
        for number in plain.setting.goal_numbers
        for kind in ("json", "png")
    ]


def test_every_decision_is_explained(face_goals: FaceGoals, goals: GoalSet, run: Path) -> None:
    result = face_goals("real_d", run=run, explanations=Path("why"), **PLANNING)
    assert len(result.trials) == 2
    for trial in result.trials:
        told = json.loads(Path(f"why/trial-{trial.goal:02d}.json").read_text())
        decisions, goal = told["decisions"], goals.goals[trial.goal]
        assert len(decisions) == 3  # of 1000, 1000 and 500 steps
        for decision in decisions:
            assert decision["goal"] == pytest.approx(goal.final_poses[0, :2])
            assert decision["state"] == pytest.approx(decision["positions_before"][0][:2])
            check_plan(decision, run)
        first, *_, last = decisions
        assert first["positions_before"][0] == pytest.approx(goal.initial_poses[0, :3], abs=1e-6)
        assert last["positions_after"][0] == pytest.approx(trial.final_poses[0][:3])
        for before, after in pairwise(decisions):
            assert before["positions_after"] == after["positions_before"]


def check_plan(decision: dict[str, Any], run: Path) -> None:
    """Its predictions are outcomes of the triplets that it names."""
    with Recording(run) as recording:
        outcomes = recording.object_poses[recording.transitions["outcome"]]
    expected = outcomes[decision["plan"], 0, :2]
    np.testing.assert_array_equal(np.reshape(decision["predicted"], (-1, 2)), expected)
    assert decision["plan_length"] == len(expected)
    missed = decision["missed_by"]
    if len(expected):
        ended = np.array(decision["positions_after"])[0, :2]
        assert missed == pytest.approx([np.linalg.norm(expected[0] - ended)])
    else:
        assert missed is None


def test_plans_are_drawn_on_the_camera_image(
    face_goals: FaceGoals, goals: GoalSet, run: Path
) -> None:
    with Recording(run) as recording:  # a goal that the farthest push leads to
        row = recording.transitions[recording.displacements()[:, 0].argmax()]
        before, after = (recording.object_poses[row[name]] for name in ("precondition", "outcome"))
    goal = replace(goals.goals[0], initial_poses=before, final_poses=after)
    facts = {**PLANNING, "n_trials": 1, "goal_set": replace(goals, goals=(goal,))}
    face_goals("real_t", run=run, explanations=Path("why"), **facts)
    told = json.loads(Path("why/trial-00.json").read_text())
    assert told["decisions"][0]["plan"]
    with Image.open("why/trial-00.png") as picture:
        colours = np.asarray(picture.convert("RGB")).reshape(-1, 3)
    for colour in ((0xD5, 0x5E, 0x00), (0x00, 0x9E, 0x73)):  # a push, a goal
        assert (colours == colour).all(axis=1).sum() > 20


def test_decisions_without_an_explanation_are_drawn_too(
    face_goals: FaceGoals,
) -> None:
    number = face_goals("real_r", explanations=Path("why"), **PLANNING).trials[1].goal
    told = json.loads(Path(f"why/trial-{number:02d}.json").read_text())
    assert {decision["title"] for decision in told["decisions"]} == {"not explained"}
    assert Path(f"why/trial-{number:02d}.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("answer", "error", "message"),
    [
        ("Explanation('odd', ['a'])", ControllerError, "facts must be names and values"),
        ("Explanation('odd', {}, (), [[1, 2]])", ControllerError, "must be finite numbers"),
        ("Explanation('odd', {}, (), [[[1, 2]] * 3])", ControllerError, "positions of 3 objects"),
        ("'because'", ControllerError, r"explain\(\) must return an Explanation, not str"),
        ("Explanation('odd', {'x': object()})", RealBenchError, "cannot be written as JSON"),
        ("Explanation('odd', {'x': float('nan')})", RealBenchError, "cannot be written as JSON"),
    ],
)
def test_malformed_explanations_are_refused(
    face_goals: FaceGoals,
    tmp_path: Path,
    answer: str,
    error: type[RealBenchError],
    message: str,
) -> None:
    file = tmp_path / "oddly.py"
    file.write_text(EXPLAINS_ODDLY.format(answer=answer))
    with pytest.raises(error, match=message):
        face_goals(str(file), explanations=Path("why"), **PLANNING)
