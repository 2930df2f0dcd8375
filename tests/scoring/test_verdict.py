from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from real_bench.errors import ControllerFailedError, ResultError, SubmissionError
from real_bench.physics import PHYSICS
from real_bench.scoring.comparison import compare
from real_bench.scoring.one_test import mixed_sources
from real_bench.scoring.result import Learned
from real_bench.scoring.verdict import failure, judge, junit, markdown
from real_bench.version import SOURCE
from tests.scoring.bench import made

FAR = made([0.3] * 20)
NEAR = made([0.05] * 20)


@pytest.mark.parametrize(
    ("minimum", "passed"), [(None, True), (0.0, True), (0.49, True), (0.51, False), (1.0, False)]
)
def test_minimum_is_compared_with_the_mean(minimum: float | None, passed: bool) -> None:
    verdict = judge([NEAR], minimum)
    assert verdict.summary.score.mean == pytest.approx(0.5)
    assert verdict.passed is passed


@pytest.mark.parametrize("minimum", [float("nan"), float("inf"), "0.3"])
def test_minimum_must_be_a_number(minimum: Any) -> None:
    with pytest.raises(ResultError, match="the minimum must be a number, not"):
        judge([NEAR], minimum)


@pytest.mark.parametrize("short", [1e-4, 1e-5, 1e-9])
def test_a_minimum_that_is_missed_does_not_look_reached(short: float) -> None:
    (check,) = [each for each in judge([NEAR], 0.5 + short).checks if each.name == "minimum"]
    shown, wanted = check.detail.split(", at least ")
    assert float(shown) < float(wanted.split()[0])


def test_worse_than_the_baseline_fails_and_better_passes() -> None:
    assert not judge([FAR], baseline=[NEAR]).passed
    assert judge([NEAR], baseline=[FAR]).passed
    assert judge([NEAR], baseline=[NEAR]).passed


def test_an_unfinished_result_fails() -> None:
    verdict = judge([made([0.1, 0.1], n_goals=3)])
    assert not verdict.passed
    assert verdict.checks[0].detail == "2 of 3 goals, not finished: 3 asked for"
    assert not judge([made([0.1, 0.1], n_goals=3)], allow_part=True).passed


def test_known_part_of_the_goals_passes_only_with_allow_part() -> None:
    """Whoever tests a part must say so: a result that leaves out the hard goals must not pass."""
    known: dict[str, Any] = {"sizes": {"5" * 64: 3}}
    whole, part = (made([0.1] * n, goals_sha256="5" * 64) for n in (3, 1))
    assert judge([whole], **known).passed
    assert judge([part]).passed  # nobody knows that there are more
    verdict = judge([part], **known)
    assert [check.name for check in verdict.checks if not check.passed] == ["complete"]
    assert verdict.checks[0].detail == "1 of 3 goals (--allow-part accepts a part)"
    assert judge([part], allow_part=True, **known).passed
    assert judge([part], allow_part=True, **known).checks[0].detail == "1 of 3 goals, a part"
    assert judge([whole], allow_part=True, **known).checks[0].detail == "3 of 3 goals"
    named = made([0.1], n_goals=3, goal_numbers=(1,))  # it says itself that there are more
    assert not judge([named]).passed
    assert judge([named], allow_part=True).passed
    other = made([0.1], goals_sha256="6" * 64)  # is believed, and vouches for nobody else
    assert not judge([part, other], **known).passed


def test_longer_trials_and_other_goals_fail() -> None:
    longer = judge([made([0.1], trial_steps=20_000)])
    assert [check.name for check in longer.checks if not check.passed] == ["length"]
    others = judge([made([0.1])], goals="5" * 64)
    assert [check.name for check in others.checks if not check.passed] == ["goals"]
    assert judge([made([0.1], goals_sha256="5" * 64)], goals="5" * 64).passed


def test_accepted_goals_are_named() -> None:
    for known, told in (({"3" * 64: 20}, "the shipped one"), ({}, "not the shipped one")):
        (check,) = [each for each in judge([NEAR], sizes=known).checks if each.name == "goals"]
        assert check.passed
        assert check.detail.startswith(f"goal set {'3' * 12}, {told}")


def test_results_of_different_tests_are_refused() -> None:
    with pytest.raises(ResultError, match="never averaged: controller real_d and real_r"):
        judge([NEAR, made([0.1] * 20, controller="real_d")])
    with pytest.raises(ResultError, match="run steps"):
        judge([NEAR, made([0.1] * 20, run_steps=1000)])


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"controller": "real_d"}, "controller real_d and real_r"),
        ({"controller_sha256": "5" * 64}, "code of the controller 2{24} and 5{24}"),
        ({"settings": {"planner": {"depth": 9}}}, "settings planner.depth=none and"),
        ({"condition": "IM"}, "condition IM and OM"),
        ({"run_steps": 15_000_000}, "run steps 0 and 15000000"),
        ({"learned": None}, "some continued from what was learned at play"),
        ({"learned_from": "process"}, "learned from process and state"),
        ({"learned": Learned(code_sha256="7" * 64, settings={})}, "code that learned 6{24} and"),
    ],
)
def test_no_side_averages_different_tests(changes: dict[str, Any], told: str) -> None:
    """Neither what is judged nor the baseline, nor either side of a comparison."""
    learned = Learned(code_sha256="6" * 64, settings={})
    base: dict[str, Any] = {"learned": learned, "learned_from": "state"}
    one, alike = (made([0.1] * 20, seed, **base) for seed in (0, 1))
    other = made([0.1] * 20, 1, **{**base, **changes})
    early = made([0.1] * 20, 1, learned=learned)  # which does not say what it learned from
    assert compare([one, early], [one])
    assert judge([one, alike], baseline=[one, alike]).comparison
    for mix in (
        lambda: judge([one, other]),
        lambda: judge([one], baseline=[one, other]),
        lambda: compare([one, other], [one]),
        lambda: compare([one], [one, other]),
    ):
        with pytest.raises(ResultError, match=f"never averaged: {told}"):
            mix()


@pytest.mark.parametrize(
    ("kinds", "is_mixed"), [(("a" * 16, "a" * 16), False), (("a" * 16, "b" * 16), True)]
)
def test_results_of_different_physics_are_marked(kinds: tuple[str, str], is_mixed: bool) -> None:
    first, second = (made([0.1] * 20, seed, versions={PHYSICS: k}) for seed, k in enumerate(kinds))
    for verdict in (judge([first, second]), judge([first], baseline=[second])):
        assert ("different physics are mixed" in markdown(verdict)) is is_mixed
        assert verdict.to_json()["physics"] == sorted(set(kinds))


@given(sources=st.lists(st.sampled_from("abc"), min_size=2, max_size=5))
def test_results_of_different_code_of_realbench_are_marked(sources: list[str]) -> None:
    results = [made([0.1] * 20, seed, versions={SOURCE: code}) for seed, code in enumerate(sources)]
    verdict, is_mixed = judge(results), len(set(sources)) > 1
    assert ("different code of realbench are averaged" in markdown(verdict)) is is_mixed
    assert verdict.to_json()["sources"] == sorted(set(sources))
    remark = mixed_sources(verdict.sources)
    assert (
        all(f"{sources.count(code)} of {code}" in remark for code in set(sources)) or not is_mixed
    )


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


@pytest.mark.parametrize("field", ["controller", "scene", "condition"])
def test_names_with_control_characters_are_refused(field: str) -> None:
    changes: dict[str, Any] = {field: "\x1b]0;title\x07"}
    with pytest.raises(ValueError, match="a name must be printable"):
        made([0.1], **changes)


def test_controller_failure_is_in_both_reports() -> None:
    page, cases = failure("mine.py", ControllerFailedError("it:\x1b failed"), 2.5)
    assert page.startswith("## mine not tested to the end\n")
    assert b'name="realbench mine.py"' in cases.tostring()
    assert "it:? failed" in page
    (case,) = ElementTree.fromstring(cases.tostring()).iter("testcase")
    assert case.find("error") is not None
    assert case.get("time") == "2.5"
    _, cases = failure("mine.py", SubmissionError("no good"), 0.0)
    (case,) = ElementTree.fromstring(cases.tostring()).iter("testcase")
    assert case.find("failure") is not None
