from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import pytest

from real_bench.errors import ResultError
from real_bench.goal_sets import GoalSet
from real_bench.scoring.verdict import judge, junit, markdown
from real_bench.simulation import Scene
from tests.cli.shell import tiny_goals
from tests.scoring.bench import made

FAR = made([0.3] * 20)
NEAR = made([0.05] * 20)


@pytest.fixture(scope="session")
def tiny_goal_set(builtin_scene: Scene) -> GoalSet:
    return tiny_goals(builtin_scene)


@pytest.mark.parametrize(
    ("minimum", "passed"), [(None, True), (0.0, True), (0.49, True), (0.51, False), (1.0, False)]
)
def test_the_minimum_is_the_mean(minimum: float | None, passed: bool) -> None:
    verdict = judge([NEAR], minimum)
    assert verdict.summary.mean == pytest.approx(0.5)
    assert verdict.passed is passed


def test_worse_than_the_baseline_fails_and_better_passes() -> None:
    assert not judge([FAR], baseline=[NEAR]).passed
    assert judge([NEAR], baseline=[FAR]).passed
    assert judge([NEAR], baseline=[NEAR]).passed


def test_an_unfinished_result_fails() -> None:
    verdict = judge([made([0.1, 0.1], n_goals=3)])
    assert not verdict.passed
    assert verdict.checks[0].told == "2 of 3 trials"


def test_a_part_of_the_goals_is_enough_where_that_is_said(tiny_goal_set: GoalSet) -> None:
    """The first goals are the easy ones: a result that leaves out the others must not pass."""
    sha256, n_goals = tiny_goal_set.sha256, len(tiny_goal_set)
    whole = made([0.1] * n_goals, goals_sha256=sha256)
    part = made([0.1], goals_sha256=sha256)
    assert judge([whole], goal_set=tiny_goal_set).passed
    assert judge([part]).passed  # nobody knows that there are more
    verdict = judge([part], goal_set=tiny_goal_set)
    assert [check.name for check in verdict.checks if not check.passed] == ["complete"]
    assert verdict.checks[0].told == f"1 of {n_goals} trials"
    assert judge([part], goal_set=tiny_goal_set, n_goals=1).passed
    assert judge([whole], goal_set=tiny_goal_set, n_goals=1).passed
    assert not judge([whole, made([0.1], 1, goals_sha256=sha256)][1:], n_goals=2).passed


def test_longer_trials_and_other_goals_fail(tiny_goal_set: GoalSet) -> None:
    longer = judge([made([0.1], trial_steps=20_000)])
    assert [check.name for check in longer.checks if not check.passed] == ["length"]
    others = judge([made([0.1] * len(tiny_goal_set))], goal_set=tiny_goal_set)
    assert [check.name for check in others.checks if not check.passed] == ["goals"]


def test_results_of_different_tests_are_refused() -> None:
    with pytest.raises(ResultError, match="never averaged: controller real_d and real_r"):
        judge([NEAR, made([0.1] * 20, controller="real_d")])
    with pytest.raises(ResultError, match="run steps"):
        judge([NEAR, made([0.1] * 20, run_steps=1000)])


def test_both_reports_say_what_failed() -> None:
    verdict = judge([FAR], 0.2, [NEAR])
    page = markdown(verdict)
    assert "REAL-R failed" in page
    assert page.count("**failed**") == 2
    root = ElementTree.fromstring(junit(verdict).tostring())
    cases = {case.get("name"): case.find("failure") for case in root.iter("testcase")}
    assert {name for name, failure in cases.items() if failure is not None} == {
        "minimum",
        "not worse than the baseline",
    }
    assert cases["complete"] is None
