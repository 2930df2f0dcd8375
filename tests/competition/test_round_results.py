"""What of a round is verified, and what the leaderboard says of it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from real_bench.competition.round_results import _goals
from real_bench.competition.verified import KeptVerdict, keep_verdicts, load_verified
from real_bench.files.hashing import file_sha256
from real_bench.goal_sets import load_goal_set
from real_bench.verification import Bundle, BundleVerdict
from real_bench.verification.parts import Part
from tests.cli.shell import realbench
from tests.competition.five import rounds, submission
from tests.competition.learner import LEARNER, forge
from tests.competition.test_ranking import FACTS


def test_leaderboard_shows_that_a_round_was_verified(place: Path) -> None:
    """On its own goals, within its own limits, and nothing but what the leaderboard shows."""
    submission(place / "submissions" / "learner", LEARNER)
    path = rounds(place, steps=2000, trial_steps=800)
    realbench(place, "round", "run", "submissions", path)
    first = place / "results" / "first"
    (home,) = first.glob("learner-*")
    shutil.copytree(home, first / "learner-0")
    change(shutil.copytree(home, first / "worse") / "standing.json", key="worse", status="crashed")
    leftover = Path(shutil.copy(home / "seed0.json", home / "seed7.json"))
    forge(leftover, lambda content: content["setting"].update(seed=7))
    done = realbench(place, "verify", "results", "--relearn", "1")
    for told in (
        "1 result passed over: of an earlier version",
        "1 result passed over: not of the round as it is now",
        "1 result passed over: of a submission that is not scored (crashed)",
        f"round first: its goals are {place / 'goals.npy'}",
    ):
        assert told in done.stderr
    assert "verified: trials, recording, code, settings, state" in done.stdout
    assert "yes" in verified_on_the_board(place)

    second = shutil.copytree(home, place / "results" / "second" / home.name)
    shutil.copy(first / "round.json", second.parent)
    change(second.parent / "round.json", name="second", goals_sha256="0" * 64)
    forge(second / "seed0.json", lambda content: content["setting"].update(goals_sha256="0" * 64))
    kept = (second / "verified.json").read_text()
    done = realbench(place, "verify", "results", "--goals", "goals.npy", "--relearn", "0")
    assert "round second is on other goals than those of --goals" in done.stderr
    assert (second / "verified.json").read_text() == kept
    assert "in part" in verified_on_the_board(place)

    limits = {"memory_gib": 4, "call_s": 0.001, "total_s": 60}
    change(first / "round.json", limits=limits)
    done = realbench(place, "verify", first, "--json", code=5)
    (found,) = json.loads(done.stdout)
    assert found["undecided"] is True
    assert "did not end within the 0.001 s of --call-limit" in found["detail"]
    assert "in part" in verified_on_the_board(place)
    realbench(place, "verify", first, "--relearn", "1", "--call-limit", "60")
    assert "yes" in verified_on_the_board(place)

    forge(home / "seed0.json", lambda content: content["trials"][0].update(distances=[0.0]))
    assert not {"yes", "NO", "in part"} & set(verified_on_the_board(place))


def change(file: Path, **fields: Any) -> None:
    """Change what a record of a competition says."""
    file.write_text(json.dumps({**json.loads(file.read_text()), **fields}))


def verified_on_the_board(place: Path) -> set[str]:
    """The last column."""
    told = realbench(place, "leaderboard", "results", "--round", "first", "--format", "markdown")
    return {line.split("|")[-2].strip() for line in told.stdout.splitlines() if "|" in line}


def test_goals_of_a_round_are_never_those_that_came_with_its_results(goals_file: Path) -> None:
    goals = load_goal_set(goals_file)
    facts = FACTS.model_copy(update={"goals": str(goals_file), "goals_sha256": goals.sha256})
    assert _goals(facts, [Path("results")]) == goals_file
    assert _goals(facts, [Path("results"), goals_file.parent]) is None
    assert _goals(facts.model_copy(update={"goals_sha256": "0" * 64}), []) is None
    assert _goals(facts.model_copy(update={"goals": str(goals_file.parent / "gone")}), []) is None


def test_what_was_verified_in_part_is_shown_as_such(place: Path) -> None:
    """Nor does it matter from where."""
    submission(place / "submissions" / "learner", LEARNER)
    path = rounds(place, steps=2000, trial_steps=800)
    realbench(place, "round", "run", "submissions", path)
    options = ["--relearn", "0", "--steps", "1000"]
    realbench(place / "results" / "first", "verify", ".", *options)
    board = realbench(place, "leaderboard", "results").stdout
    assert " in part" in board
    assert "in part: recording; not checked: state, play" in " ".join(board.split())


def made_verdict(home: Path, name: str, *verdicts: str) -> BundleVerdict:
    result = home / name
    result.write_text(name)
    made = tuple(Part(f"part{number}", verdict, "") for number, verdict in enumerate(verdicts))
    return BundleVerdict(Bundle(result, None, None), file_sha256(result), 0.5, made)


@pytest.mark.parametrize(
    ("first", "second", "kept"),
    [
        (["holds", "holds"], ["holds", "holds"], (True, ())),
        (["holds", "holds"], ["holds", "in part"], (True, ("part1",))),
        (["holds", "undecided"], ["FAILS", "holds"], (False, ())),
        (["not checked", "holds"], ["FAILS", "holds"], (False, ())),
        (["holds", "undecided"], ["holds", "holds"], None),
    ],
)
def test_worst_verdict_of_several_is_kept(
    tmp_path: Path, first: list[str], second: list[str], kept: tuple[bool, tuple[str, ...]] | None
) -> None:
    keep_verdicts(
        tmp_path,
        [made_verdict(tmp_path, "0.json", *first), made_verdict(tmp_path, "1.json", *second)],
    )
    found = KeptVerdict.load(tmp_path)
    assert (found and (found.holds, found.unchecked)) == kept


def test_verdict_is_of_the_file_that_was_verified(tmp_path: Path) -> None:
    """Which may have changed during the hours that this took."""
    verdict = made_verdict(tmp_path, "0.json", "holds")
    verdict.bundle.result.write_text("another")
    keep_verdicts(tmp_path, [verdict])
    assert load_verified(tmp_path, [verdict.result_sha256]) is not None
    assert load_verified(tmp_path, [file_sha256(verdict.bundle.result)]) is None
