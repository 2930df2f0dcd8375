from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import pytest

from real_bench.errors import ResultError
from real_bench.scoring.verdict import judge, junit, markdown
from tests.scoring.bench import made

FAR = made([0.3] * 20)
NEAR = made([0.05] * 20)


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
