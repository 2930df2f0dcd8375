from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from real_bench.competition.leaderboard import Leaderboard, cells, notes
from real_bench.competition.ranking import Row, ranked, read_rows
from real_bench.competition.round_file import NOT_OF_THIS_ROUND, RoundFacts, result_name
from real_bench.competition.standing import UNTOLD, FailureRecord, Standing, Status
from real_bench.scoring.comparison import compare
from real_bench.scoring.repeats import by_goal, summarise_repeats
from real_bench.scoring.result import Learned
from tests.scoring.bench import made

DISTANCES = st.lists(st.floats(0.0, 0.5), min_size=8, max_size=8)


def row(key: str, distances: list[float] | None, status: Status = "scored") -> Row:
    """A submission with these distances, or one that failed."""
    standing = Standing(
        key=key, name=key, authors=(), description="", sha256="1" * 64, date="", status=status
    )
    if distances is None:
        return Row(standing, Path())
    results = (made(distances),)
    return Row(standing, Path(), (), results, summarise_repeats(by_goal(results)))


def ranks(rows: list[Row]) -> list[tuple[str, int | None]]:
    return [(each.standing.key, each.rank) for each in rows]


def test_indistinguishable_submissions_share_a_rank() -> None:
    near = [0.00, 0.01, 0.02, 0.01, 0.00, 0.02, 0.01, 0.00]
    like = [0.01, 0.00, 0.01, 0.02, 0.01, 0.00, 0.02, 0.01]
    far = [0.30, 0.31, 0.29, 0.32, 0.30, 0.33, 0.28, 0.30]
    rows = [row("far", far), row("near", near), row("like", like), row("lost", None, "crashed")]
    found = ranked(rows, "excluded", "paired")
    assert {each.standing.key for each in found[:2]} == {"near", "like"}
    assert [each.rank for each in found] == [1, 1, 3, None]
    assert found[0].against_first is None
    assert found[1].against_first is not None
    assert ranks(ranked(rows, "zero", "paired"))[-1] == ("lost", 4)
    alone = ranked(rows, "excluded", "none")
    assert [each.rank for each in alone] == [1, 2, 3, None]


def test_equal_submissions_share_a_rank_under_every_rule() -> None:
    rows = [row("b", [0.1, 0.2, 0.3]), row("a", [0.1, 0.2, 0.3])]
    for ties in ("none", "paired"):
        assert ranks(ranked(rows, "zero", ties)) == [("a", 1), ("b", 1)]


def test_board_tells_submissions_of_the_same_name_apart() -> None:
    rows = [row("a", [0.1]), row("b", [0.2]), row("c", None, "crashed")]
    same = [replace(each, standing=each.standing.model_copy(update={"name": "N"})) for each in rows]
    board = Leaderboard(FACTS, (same[0], same[1], rows[2]))
    assert [cells(board, each)[1] for each in board.rows] == ["N (a)", "N (b)", "c"]


def test_waiting_submission_has_no_rank() -> None:
    rows = [row("a", None, "waiting"), row("b", None, "refused"), row("c", [0.1, 0.2])]
    assert ranks(ranked(rows, "zero", "paired")) == [("c", 1), ("b", 2), ("a", None)]


FACTS = RoundFacts(
    title="T",
    name="r",
    condition="OM",
    objects=1,
    scene="builtin",
    play="own",
    steps=1,
    trial_steps=1,
    repeats=1,
    limits={},
    failure="zero",
    ties="none",
    goals="goals.npy",
    goals_sha256="",
    n_goals=3,
    hidden=False,
    commitment="",
)


def test_damaged_result_leaves_the_others_on_the_board(tmp_path: Path) -> None:
    for key in ("first", "damaged"):
        (tmp_path / key).mkdir()
        row(key, [0.1]).standing.save(tmp_path / key)
        (tmp_path / key / "score1.json").write_text("{")
    FACTS.save(tmp_path)
    rows = {each.standing.key: each.standing for each in read_rows(tmp_path, FACTS)}
    assert {standing.status for standing in rows.values()} == {"waiting"}
    assert "score1.json" in rows["damaged"].detail
    assert str(tmp_path) not in rows["damaged"].detail


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"learned": Learned(code_sha256="", settings={})}, "some continued from what was learned"),
        ({"settings": {"depth": 1}}, "results of different tests are never averaged"),
        ({"control_version": 2}, NOT_OF_THIS_ROUND),
        ({"run_steps": 4000, "run_sha256": "5" * 64}, NOT_OF_THIS_ROUND),
        ({"distances": [0.1]}, NOT_OF_THIS_ROUND),
    ],
)
def test_odd_result_leaves_the_others_on_the_board(
    tmp_path: Path, changes: dict[str, Any], told: str
) -> None:
    """Of another test than its fellows, another version of control, after a play, unfinished."""
    found = ranked_with_an_odd_result(tmp_path, changes, hidden=False)
    assert ranks(found) == [("fine", 1), ("odd", None)]
    assert told in found[1].standing.detail


def test_settings_of_odd_results_are_untold_while_goals_are_secret(tmp_path: Path) -> None:
    """A controller chooses what its settings are, and could tell of goals by them."""
    changes = {"settings": {"goal": "0.1 0.2 0.3"}}
    found = ranked_with_an_odd_result(tmp_path, changes, hidden=True)
    assert found[1].standing.detail == UNTOLD
    broken = row("b", None, "broken rule").standing.model_copy(update={"detail": "0.1 0.2 0.3"})
    assert FACTS.model_copy(update={"hidden": True}).shown(broken).detail == UNTOLD


def ranked_with_an_odd_result(home: Path, changes: dict[str, Any], *, hidden: bool) -> list[Row]:
    """A round of two submissions, of which one has a result that is changed."""
    shape = {"play": "none", "seeds": (0, 1), "n_goals": 2, "trial_steps": 10_000}
    known = {"goals_sha256": "3" * 64, "control_version": 1, "hidden": hidden}
    facts = FACTS.model_copy(update={**shape, **known})
    for key, distance, changed in (("fine", 0.2, {}), ("odd", 0.1, changes)):
        (home / key).mkdir()
        row(key, None).standing.save(home / key)
        for seed in facts.seeds:
            fields = {"distances": [distance, 0.3], "n_goals": 2, **(changed if seed else {})}
            made(seed=seed, **fields).save(home / key / result_name(seed))
    return ranked(read_rows(home, facts), "zero", "paired")


@given(place=st.sampled_from(["play", "test", "test, goal 7"]), text=st.text())
def test_failure_without_its_reason_has_nothing_of_the_controllers_text(
    place: str, text: str
) -> None:
    """But for a number of six digits, where it pretends that it is at a goal."""
    failed = FailureRecord(status="crashed", detail=f"{place}, {text}")
    goal = len(", goal 123456")
    assert len(failed.without_reason().detail) <= len(f"{place} ({UNTOLD})") + goal
    at_goal = FailureRecord(status="crashed", detail=f"test, goal 12: {text}")
    assert at_goal.without_reason().detail == f"test, goal 12 ({UNTOLD})"


@pytest.mark.parametrize(("status", "counts"), [("waiting", False), ("refused", True)])
def test_board_tells_of_failures_only_where_one_counts(status: Status, counts: bool) -> None:
    rows = [row("a", [0.1, 0.2, 0.3]), row("b", None, status)]
    told = notes(Leaderboard(FACTS, tuple(ranked(rows, "zero", "none"))))
    assert ("a failed submission counts as 0" in told) == counts


@settings(max_examples=40, deadline=None)
@given(st.lists(DISTANCES, min_size=1, max_size=5), st.randoms())
def test_ranks_follow_means_and_group_the_indistinguishable(
    many: list[list[float]], shuffle: object
) -> None:
    """Ranks follow the means, whatever the order; a group is one that its first cannot be told
    from, and the next group begins with one that can."""
    rows = [row(f"s{number}", distances) for number, distances in enumerate(many)]
    found = ranked(rows, "excluded", "paired")
    mixed = list(rows)
    shuffle.shuffle(mixed)  # type: ignore[attr-defined]
    assert ranks(ranked(mixed, "excluded", "paired")) == ranks(found)
    assert [each.mean for each in found] == sorted((each.mean for each in found), reverse=True)
    first = found[0]
    for number, each in enumerate(found):
        assert each.rank is not None
        assert each.rank <= number + 1
        interval = compare(each.results, first.results).score.interval
        cannot_tell = interval is None or interval.low <= 0 <= interval.high
        if each.rank == first.rank:
            assert cannot_tell
        else:
            assert not cannot_tell
            assert each.rank == number + 1
            first = each
