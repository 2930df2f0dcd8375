from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from real_bench.errors import ResultError
from real_bench.scoring.comparison import compare
from real_bench.scoring.repeats import by_goal, summarise_repeats
from real_bench.scoring.result import Result
from real_bench.scoring.sides import distinguishing, remarks, side_json
from real_bench.version import SOURCE
from tests.scoring.bench import made

Make = Callable[..., Result]
DISTANCES = st.lists(st.floats(0, 1), min_size=4, max_size=4)


def test_comparison_matches_a_hand_calculation() -> None:
    """Scores at 0, 10 and 20 cm are 1, 1/4 and 1/16."""
    a = [made([0.0, 0.1, 0.2, 0.2]), made([0.0, 0.2, 0.2, 0.2], seed=1)]
    b = [made([0.1, 0.1, 0.2, 0.0])]
    found = compare(a, b)
    goals = [(1, 1 / 4), (5 / 32, 1 / 4), (1 / 16, 1 / 16), (1 / 16, 1)]
    assert [(goal.a, goal.b) for goal in found.goals] == [pytest.approx(goal) for goal in goals]
    assert found.n_repeats == (2, 1)
    score = found.score
    assert score.a == pytest.approx(np.mean([a for a, _ in goals]))
    assert score.difference == pytest.approx(np.mean([a - b for a, b in goals]))
    # better; a tie and a loss; a tie; a loss
    assert score.improvement == pytest.approx(np.mean([1, 1 / 4, 1 / 2, 0]))
    assert score.interval is not None
    assert score.interval.low <= score.difference <= score.interval.high
    assert score.interval.over == "goals"
    assert not found.is_worse
    assert found.metrics["distance"].difference == pytest.approx(0.1375 - 0.1)
    assert found.metrics["distance"].improvement == score.improvement  # nearer is better
    assert found.to_json()["metrics"]["actions"] is None  # their commands were not kept


@given(DISTANCES, DISTANCES)
def test_swapped_comparison_says_the_opposite(a: list[float], b: list[float]) -> None:
    one, other = (compare([made(x)], [made(y)]).score for x, y in ((a, b), (b, a)))
    assert one.difference == pytest.approx(-other.difference)
    assert other.improvement is not None
    assert one.improvement == pytest.approx(1 - other.improvement)
    assert one.interval is not None
    assert other.interval is not None
    assert one.interval.low == pytest.approx(-other.interval.high, abs=0.02)


@given(DISTANCES)
def test_result_does_not_differ_from_itself(distances: list[float]) -> None:
    same = compare([made(distances)], [made(distances)])
    assert same.score.difference == 0
    assert same.score.improvement == 0.5
    assert not same.is_worse


def test_the_order_of_files_does_not_matter() -> None:
    results = [made([0.1, 0.2], seed=0), made([0.3, 0.4], seed=1)]
    results += [made([0.5, 0.6], seed=seed, goals_sha256="5" * 64) for seed in (0, 1)]
    tables = [by_goal(order) for order in itertools.permutations(results)]
    for table in tables:
        assert table.keys == tables[0].keys
        assert (table.values("score") == tables[0].values("score")).all()
    assert tables[0].values("score").shape == (2, 4)


def test_clearly_worse_results_are_reported_as_worse() -> None:
    near, far = [0.01 * n for n in range(20)], [0.2 + 0.01 * n for n in range(20)]
    assert compare([made(far)], [made(near)]).is_worse
    assert not compare([made(near)], [made(far)]).is_worse


def plays(
    distances: Sequence[Sequence[float]], runs: str, changes: dict[str, Any] | None = None
) -> list[Result]:
    """One result a play, of recordings that are named by a letter each."""
    return [
        made(each, seed=seed, run_sha256=run * 64, **(changes or {}))
        for seed, (each, run) in enumerate(zip(distances, runs, strict=True))
    ]


SPREAD = [[0.02, 0.03, 0.05, 0.01], [0.1, 0.12, 0.15, 0.11], [0.3, 0.33, 0.4, 0.32]]
SHIFTED = [[each + 0.002 for each in play] for play in SPREAD]


def test_difference_after_the_same_plays_is_taken_play_by_play() -> None:
    """Plays differ much, and both controllers alike: only then a small difference shows."""
    paired = compare(plays(SPREAD, "abc"), plays(SHIFTED, "abc"))
    apart = compare(plays(SPREAD, "abc"), plays(SHIFTED, "def"))
    assert (paired.same_plays, apart.same_plays) == (True, False)
    assert paired.score.difference == apart.score.difference
    one, other = paired.score.interval, apart.score.interval
    assert one is not None
    assert other is not None
    assert one.over == other.over == "plays and goals"
    assert one.high - one.low < other.high - other.low
    assert (
        apart.score.interval == compare(plays(SPREAD, "cab"), plays(SHIFTED, "def")).score.interval
    )


def test_the_interval_of_two_plays_is_over_goals_and_says_so() -> None:
    a, b = plays(SPREAD[:2], "ab"), plays(SPREAD, "def")
    found = compare(a, b)
    assert found.score.interval is not None
    assert found.score.interval.over == "goals"
    assert any("after these plays" in line for line in remarks(found, a, b))


def test_the_same_controller_after_other_plays_is_not_found_worse() -> None:
    """Over goals alone, play against play, it would be."""
    a, b = plays(SPREAD, "abc"), plays(SPREAD[::-1], "def")
    assert not compare(a, b).is_worse
    assert compare(plays(SPREAD[2:], "c"), plays(SPREAD[:1], "a")).is_worse


def test_a_play_that_was_tested_twice_counts_once() -> None:
    twice = [*plays([[0.0] * 4], "a"), made([0.1] * 4, seed=5, run_sha256="b" * 64)]
    twice.append(made([0.1] * 4, seed=6, run_sha256="b" * 64))
    found = compare(twice, plays([[0.1] * 4], "c"))
    assert found.score.a == pytest.approx((1 + 1 / 4) / 2)
    assert found.n_repeats == (3, 1)
    assert found.n_plays == (2, 1)
    assert found.goals[0].a == pytest.approx((1 + 1 / 4) / 2)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"settings": {"planner": {"depth": 9}}}, "planner.depth=9"),
        ({"controller_sha256": "7" * 64}, "code 777777"),
        ({}, ""),
    ],
)
def test_sides_of_one_name_tell_how_they_differ(changes: dict[str, Any], told: str) -> None:
    setting, other = made([0.1], **changes).setting, made([0.1]).setting
    assert distinguishing(setting, other) == told


def test_different_code_of_realbench_is_told_across_sides() -> None:
    a, b = (plays(SPREAD, "abc", {"versions": {SOURCE: each * 16}}) for each in "ab")
    (told,) = (line for line in remarks(compare(a, b), a, b) if "different code" in line)
    assert "a" * 16 in told
    assert "b" * 16 in told
    assert side_json(a)["results"][0]["source"] == "a" * 16


@pytest.mark.parametrize(
    ("other", "told"),
    [
        (made([0.1]), "not on the same goals: 2 and 1, 1 of them in common"),
        (made([0.1, 0.1], goals_sha256="6" * 64), "0 of them in common"),
        (made([0.1, 0.1], scene_sha256="6" * 64), "differ in scene sha256"),
        (made([0.1, 0.1], control_version=2), "two versions of macro-actions"),
        (made([0.1, 0.1], trial_steps=20), "differ in trial steps: 10000, 20"),
        (made([]), "has no trial yet"),
    ],
)
def test_incomparable_results_are_refused(other: Result, told: str) -> None:
    with pytest.raises(ResultError, match=told):
        compare([made([0.1, 0.2])], [other])


def test_same_test_cannot_count_twice() -> None:
    with pytest.raises(ResultError, match="two results are of the same test"):
        by_goal([made([0.1, 0.2]), made([0.1, 0.2])])
    other = made([0.1, 0.2], run_sha256="8" * 64)  # the same seed of the test, another play
    assert by_goal([made([0.1, 0.2]), other]).values("score").shape == (2, 2)


def test_tests_after_one_play_count_as_one_play() -> None:
    """Or an interval over plays would tell only how tests vary."""
    after = {"run_sha256": "8" * 64}
    results = [made([0.1 * seed, 0.2], seed, **after) for seed in range(3)]
    summary = summarise_repeats(by_goal(results))
    assert (summary.n_repeats, summary.n_plays) == (3, 1)
    assert summary.score.interval is not None
    assert summary.score.interval.over == "goals"
    others = [made([0.1 * seed, 0.2], seed, run_sha256=f"{seed}" * 64) for seed in range(3)]
    summary = summarise_repeats(by_goal(others))
    assert (summary.n_repeats, summary.n_plays) == (3, 3)
    assert summary.score.interval is not None
    assert summary.score.interval.over == "plays and goals"


def test_a_play_counts_once_however_often_it_was_tested() -> None:
    """Or a mean could lie outside its own interval."""
    often = [made([0.0, 0.0], seed, run_sha256="8" * 64) for seed in range(8)]
    once = [made([0.1, 0.1], 9, run_sha256=name * 64) for name in "67"]
    score = summarise_repeats(by_goal([*often, *once])).score
    assert score.mean == pytest.approx((1 + 0.25 + 0.25) / 3)
    assert score.standard_error == pytest.approx(0.75 / 3)
    assert score.interval is not None
    assert score.interval.low <= score.mean <= score.interval.high <= 1
    assert len(score.by_repeat) == 10


def test_repeats_must_be_complete() -> None:
    with pytest.raises(ResultError, match="equally many results"):
        by_goal([made([0.1]), made([0.2], seed=1), made([0.2], goals_sha256="7" * 64)])
    with pytest.raises(ResultError, match="none at all"):
        by_goal([])


def test_repeats_have_one_seed_on_every_goal_set() -> None:
    def on(goals: str, seed: int, run: str = "") -> Result:
        return made([0.1], seed, goals_sha256=goals * 64, run_sha256=(run or str(seed)) * 64)

    table = by_goal([on("b", 1), on("a", 0), on("b", 0), on("a", 1)])
    assert table.plays == tuple(f"{run * 64} {run * 64}" for run in "01")
    with pytest.raises(ResultError, match="the same seeds, not aaaaaaaa: 0, 1; bbbbbbbb: 1, 2"):
        by_goal([on("a", 0), on("a", 1), on("b", 1), on("b", 2)])
    table = by_goal([on("a", 0, "c"), on("a", 0, "d"), on("b", 0, "d"), on("b", 0, "c")])
    assert table.plays == tuple(f"{run * 64} {run * 64}" for run in "cd")
    with pytest.raises(ResultError, match="results with seed 0 are after different recordings"):
        by_goal([on("a", 0, "c"), on("a", 0, "d"), on("b", 0, "d"), on("b", 0, "e")])


def test_result_without_trials_is_named_as_such() -> None:
    with pytest.raises(ResultError, match="a result has no trial yet"):
        by_goal([made([])])
