"""The same seed gives the same bytes, whatever else happens around it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from real_bench.actions import Action
from real_bench.conditions import Condition
from real_bench.goal_sets import GoalSet, save_goal_set
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.trial import TrialPlan
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from real_bench.task import Task
from tests.cli.shell import realbench
from tests.recording.bench import ignore

CONDITIONS = ("OM", "OJ")


@pytest.fixture(scope="module", params=CONDITIONS)
def alone(
    request: pytest.FixtureRequest, goals: GoalSet, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, str]:
    """A folder with a test in a process of its own that did nothing else; its condition."""
    folder = tmp_path_factory.mktemp("alone")
    save_goal_set(goals, folder / "goals.npy")
    realbench(folder, *command(request.param), "--out", "alone.json")
    return folder, request.param


def command(condition: str) -> list[str]:
    told = ["extrinsic", "--controller", "real_r", "--condition", condition, "--scene", "builtin"]
    return [*told, "--goals", "goals.npy", "--trials", "3", "--trial-steps", "1500", "--seed", "4"]


def kept(folder: Path, name: str) -> tuple[object, ...]:
    """All that a result keeps of its trials: scores, poses, commands."""
    return load_result(folder / name).trials


@pytest.mark.parametrize("options", [["--isolate"], ["--jobs", "2", "--isolate"]])
def test_processes_and_isolation_do_not_matter(alone: tuple[Path, str], options: list[str]) -> None:
    folder, condition = alone
    out = f"{'-'.join(options)}.json"
    realbench(folder, *command(condition), *options, "--out", out)
    assert kept(folder, out) == kept(folder, "alone.json")


def test_point_of_resuming_does_not_matter(alone: tuple[Path, str]) -> None:
    folder, condition = alone
    whole = load_result(folder / "alone.json")
    for done in range(len(whole.trials)):
        part = whole.model_copy(
            update={"trials": whole.trials[done : done + 1], "seconds": {done: 1.0}}
        )
        part.save(folder / "part.json")
        realbench(folder, *command(condition), "--resume", "--out", "part.json")
        assert kept(folder, "part.json") == whole.trials


def test_what_the_process_did_before_does_not_matter(
    alone: tuple[Path, str], goals: GoalSet, scene: Scene
) -> None:
    """Three other simulations, still open, of other conditions and numbers of objects."""
    folder, condition = alone
    others = [
        Task(scene, Condition.parse(name), n) for name, n in (("OM", 3), ("IJ", 1), ("OC", 2))
    ]
    for task in others:
        task.begin()
    others[0].execute(Action.macro(np.array([[-0.1, 0.3], [-0.1, -0.3]])))
    others[1].execute(Action(np.full((1, 9), 0.3), np.array([400]), np.array([False])))
    plan = TrialPlan("real_r", Condition.parse(condition), scene, goals, 4, 1500)
    result = ExtrinsicPhase(plan, 3, folder / "after.json").run(ignore)
    for task in others:
        task.close()
    assert result.trials == kept(folder, "alone.json")


def test_result_file_is_the_same_except_for_its_timing(alone: tuple[Path, str]) -> None:
    folder, condition = alone
    realbench(folder, *command(condition), "--out", "again.json")
    first, again = (
        json.loads((folder / f"{name}.json").read_text()) for name in ("alone", "again")
    )
    assert first.pop("timing") != {}
    again.pop("timing")
    assert first == again
