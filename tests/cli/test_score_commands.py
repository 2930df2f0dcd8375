from __future__ import annotations

import json
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pytest

from real_bench.goal_sets import save_goal_set
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from real_bench.version import SOURCE
from tests.cli.shell import TOUCHES, realbench, tiny_goals, write_controller
from tests.scoring.bench import made


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "near").mkdir()
    for seed in (0, 1):
        made([0.05, 0.06, 0.07, 0.08], seed).save(tmp_path / "near" / f"seed{seed}.json")
    made([0.3, 0.3, 0.3, 0.3]).save(tmp_path / "far.json")
    return tmp_path


@pytest.mark.parametrize("near", ["near", "near/*.json", "near/seed?.json"])
def test_compare_takes_files_folders_and_patterns(folder: Path, near: str) -> None:
    told = json.loads(realbench(folder, "compare", near, "far.json", "--json").stdout)
    assert told["n_repeats"] == [2, 1]
    assert told["metrics"]["score"]["improvement"] == 1.0
    assert len(told["goals"]) == 4
    page = realbench(folder, "compare", near, "far.json").stdout
    assert "A better" in page
    assert page.count("95% over goals") == 2


def test_compare_says_which_side_is_of_different_code(folder: Path) -> None:
    made([0.05, 0.06, 0.07, 0.08], 2, versions={SOURCE: "a" * 16}).save(folder / "near/seed2.json")
    page = " ".join(realbench(folder, "compare", "far.json", "near").stdout.split())
    assert "B: results of different code of realbench are averaged (2 of unknown, 1 of aa" in page
    assert "A: results of different" not in page


def test_exit_code_says_whether_score_passed(folder: Path) -> None:
    realbench(folder, "score", "near", "--min", "0.3", "--baseline", "far.json")
    failed = realbench(folder, "score", "far.json", "--min", "0.3", code=3)
    assert "not passed: minimum: 0.0156, at least 0.3 required" in failed.stderr
    done = realbench(folder, "score", "far.json", "--baseline", "near/seed0.json", code=3)
    assert "not worse than the baseline" in done.stderr


def test_score_writes_markdown_and_junit_files(folder: Path) -> None:
    (folder / "summary.md").write_text("# Before\n")
    files = ("--markdown", "summary.md", "--junit", "junit.xml")
    told = json.loads(realbench(folder, "score", "near", *files, "--json").stdout)
    assert told["passed"] is True
    page = (folder / "summary.md").read_text()
    assert page.startswith("# Before\n## REAL-R passed")
    root = ElementTree.parse(folder / "junit.xml").getroot()
    assert [case.get("name") for case in root.iter("testcase")] == ["complete", "length", "goals"]
    again = realbench(folder, "score", "near", *files, code=1)
    assert "junit.xml exists" in again.stderr
    realbench(folder, "score", "near", *files, "--overwrite")


NO_PATTERN = (
    "no result found in x**.json" if sys.version_info >= (3, 13) else "x**.json is not a pattern"
)


@pytest.mark.parametrize(
    ("named", "told"),
    [
        ("no.json", "result not found: no.json"),
        ("none/*.json", "no result found in"),
        (".", "no result found in"),
        ("x**.json", NO_PATTERN),
    ],
)
def test_missing_results_are_reported(tmp_path: Path, named: str, told: str) -> None:
    assert told in realbench(tmp_path, "score", named, code=1).stderr
    assert told in realbench(tmp_path, "compare", named, named, code=1).stderr


def test_folder_may_hold_other_json_files_but_no_damaged_result(folder: Path) -> None:
    (folder / "near" / "standing.json").write_text('{"status": "scored"}')
    told = json.loads(realbench(folder, "compare", "near", "far.json", "--json").stdout)
    assert told["n_repeats"] == [2, 1]
    (folder / "near" / "seed2.json").write_bytes((folder / "far.json").read_bytes()[:-9])
    refused = realbench(folder, "compare", "near", "far.json", code=1).stderr
    assert "seed2.json cannot be read: not a result, or damaged" in refused


TEST = ["--controller", "mine.py", "--condition", "OM", "--scene", "builtin"]


@pytest.fixture
def submission(tmp_path: Path, builtin_scene: Scene) -> Path:
    """A folder with a controller that leaves a trace where it can, and two goals."""
    write_controller(tmp_path / "mine.py", *TOUCHES)
    save_goal_set(tiny_goals(builtin_scene), tmp_path / "goals.npy")
    return tmp_path


def test_a_submission_is_tested_in_isolation_and_judged(
    submission: Path, builtin_scene: Scene
) -> None:
    save_goal_set(tiny_goals(builtin_scene, n_goals=1), submission / "goal.npy")
    told = [*TEST, "--goals", "goal.npy"]
    done = realbench(submission, "score", *told, "--min", "0.9", "--junit", "junit.xml", code=3)
    assert done.stderr.startswith("the controller is isolated by ")
    assert "not passed: minimum" in done.stderr
    assert "result: score.json" in done.stdout
    assert "## mine failed" in done.stdout
    assert (submission / "junit.xml").exists()
    assert not (submission / "touched").exists()
    result = load_result(submission / "score.json")
    assert result.is_complete
    exists = realbench(submission, "score", *told, "--min", "0", code=1)
    assert "score.json exists: use --resume or --overwrite" in exists.stderr
    again = realbench(submission, "score", *told, "--min", "0", "--resume", "--json")
    assert json.loads(again.stdout)["passed"] is True
    realbench(submission, "score", *told, "--no-isolate", "--out", "trusted.json")
    assert (submission / "touched").exists()
    assert load_result(submission / "trusted.json").trials == result.trials


def test_a_baseline_that_cannot_be_compared_is_refused_before_the_test(
    submission: Path, builtin_scene: Scene
) -> None:
    test = ("score", *TEST, "--goals", "goals.npy", "--baseline", "best.json")
    for changed, told in (
        ({"scene": "official"}, "the baseline has scene official, the test builtin"),
        ({"scene_sha256": "1" * 64}, f"the baseline has scene sha256 {'1' * 64}, the test "),
        ({"trial_steps": 2000}, "the baseline has trial steps 2000, the test 10000"),
        ({}, "the baseline is not on the goals of the test"),
    ):
        fields: dict[str, Any] = {"scene_sha256": builtin_scene.sha256, **changed}
        made([0.3] * 4, **fields).save(submission / "best.json")
        assert told in realbench(submission, *test, code=1).stderr
        assert not (submission / "score.json").exists()


def test_testing_part_of_the_goals_needs_allow_part(submission: Path) -> None:
    goals = ("--goals", "goals.npy")
    refused = realbench(submission, "score", *TEST, *goals, "--trials", "1", code=2)
    assert "--trials 1 tests only a part of the 2 goals" in refused.stderr
    assert "add --allow-part" in refused.stderr
    assert not (submission / "score.json").exists()
    realbench(submission, "score", *TEST, *goals, "--trials", "1", "--allow-part")
    for told in (goals, ()):  # the result says itself that it is a part
        done = realbench(submission, "score", "score.json", *told, code=3)
        assert "not passed: complete: 1 of 2 goals (--allow-part" in done.stderr
    done = realbench(submission, "score", "score.json", "--allow-part")
    assert "1 of 2 goals, a part" in done.stdout
    assert "not the shipped one" in done.stdout


def test_output_readable_by_the_submission_is_refused(
    submission: Path, builtin_scene: Scene
) -> None:
    (submission / "package").mkdir()
    (submission / "package" / "__init__.py").touch()
    secret = ("--baseline", "package/best.json")
    best = made([0.3] * 4, scene_sha256=builtin_scene.sha256)
    best.save(submission / "package" / "best.json")
    done = realbench(submission, "score", *TEST, "--goals", "goals.npy", *secret, code=1)
    assert "lies where an isolated controller may read" not in done.stderr  # it is hidden
    assert (
        "the baseline is not on the goals" in done.stderr
    )  # with the made-up one it cannot be compared
    assert not (submission / "score.json").exists()
    later = ("--junit", "package/cases.xml", "--overwrite")
    done = realbench(submission, "score", *TEST, "--goals", "goals.npy", *later, code=1)
    assert "cases.xml lies where an isolated controller may read" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], "give result files, or --controller or --run"),
        (["far.json", "--controller", "real_r"], "--controller is for running a test"),
        (["far.json", "--jobs", "1"], "--jobs is for running a test"),
        (["far.json", "--trials", "1"], "--trials is for running a test"),
        (["far.json", "--no-isolate"], "--isolate is for running a test"),
    ],
)
def test_score_needs_either_results_or_a_test(
    folder: Path, arguments: list[str], told: str
) -> None:
    assert told in realbench(folder, "score", *arguments, code=2).stderr
