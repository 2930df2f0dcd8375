from __future__ import annotations

import json
import os
import random
import re
import shutil
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier
from typing import Any

import pytest

from real_bench.competition.entries import Entry, read_entries
from real_bench.competition.leaderboard import read_leaderboards
from real_bench.competition.round_file import load_round
from real_bench.competition.running import RoundRun
from real_bench.competition.spec import read_competition
from real_bench.controller_code.packing import pack
from real_bench.controls import CONTROLS
from real_bench.errors import ExperimentError
from real_bench.goal_sets import generate_goal_set, save_goal_set
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from tests.cli.shell import killed_at_work, realbench
from tests.competition.five import CRASHING, GOOD, MEMORY, ROUND, derived, rounds, submission
from tests.competition.learner import forge


def rows_of(place: Path, name: str = "first") -> dict[str, Any]:
    told = realbench(place, "leaderboard", "results", "--format", "json").stdout
    return {row["key"]: row for row in json.loads(told)[name]["rows"]}


def without_times(rows: dict[str, Any]) -> dict[str, Any]:
    """All but how long things took."""
    for row in rows.values():
        row.pop("seconds")
        for failed in row["failures"].values():
            failed.pop("seconds")
    return rows


def test_killed_round_resumes_to_the_same_standings(place: Path) -> None:
    submissions = place / "submissions"
    submission(submissions / "good", GOOD)
    submission(submissions / "crashing", derived(CRASHING), entry="controller.py:Crashing")
    path = rounds(place, trial_steps=1000)
    run = ["round", "run", "submissions", path, "--jobs", "2"]
    realbench(place, *run)
    undisturbed = without_times(rows_of(place))
    (place / "results").rename(place / "kept")
    moments = random.Random(3)
    killed = [
        killed_at_work(place, *run, results=place / "results", pause_s=moments.uniform(0, 0.5))
        for _ in range(3)
    ]
    assert any(killed)
    realbench(place, *run)
    assert without_times(rows_of(place)) == undisturbed
    assert undisturbed["good"]["rank"] == 1


def test_archives_and_new_versions_are_run_and_misfits_refused(place: Path) -> None:
    """A zip is played as it was handed in; a new version is another one; others are refused."""
    submissions = place / "submissions"
    folder = submission(place / "work", GOOD)
    submissions.mkdir()
    pack(folder, submissions / "team.zip")
    submission(submissions / "other", GOOD, condition="IM")
    (submissions / "empty").mkdir()
    (submissions / "bad.zip").write_bytes(b"PK nothing")
    (submissions / "notes.txt").write_text("no submission")
    path = rounds(place, play="none", trial_steps=300)
    realbench(place, "round", "run", "submissions", path)
    rows = rows_of(place)
    assert rows["team"]["status"] == "scored"
    assert rows["other"]["detail"] == "it is made for IM, but the round is OM"
    assert rows["empty"]["detail"] == "empty has no submission.yaml"
    assert "cannot be unpacked" in rows["bad"]["detail"]
    result = load_result(next((place / "results" / "first").glob("team-*/seed0.json")))
    assert result.setting.controller.endswith(":Work")
    first = rows["team"]["sha256"]
    (folder / "controller.py").write_text(GOOD + "\nNEW = True\n")
    (submissions / "team.zip").unlink()
    pack(folder, submissions / "team.zip")
    realbench(place, "round", "run", "submissions", path)
    assert rows_of(place)["team"]["sha256"] != first
    assert len(list((place / "results" / "first").glob("team-*"))) == 2


def test_version_handed_in_last_is_the_one_that_is_shown(place: Path) -> None:
    """Also if it was handed in before, and whatever the dates of its files."""
    submissions = place / "submissions"
    path = rounds(place, play="none", trial_steps=300)
    handed_in = []
    for code in (GOOD, f"{GOOD}\nNEW = True\n", GOOD):
        shutil.rmtree(submissions, ignore_errors=True)
        folder = submission(submissions / "team", code)
        for file in folder.iterdir():
            os.utime(file, (315532800, 315532800))  # 1980, as in an archive
        realbench(place, "round", "run", "submissions", path)
        handed_in.append(rows_of(place)["team"]["sha256"])
    assert handed_in[0] != handed_in[1]
    assert handed_in[0] == handed_in[2]


def test_only_results_of_the_round_as_it_is_now_are_ranked(place: Path) -> None:
    """Of fewer repeats, and of a submission that was withdrawn before the round changed."""
    submissions = place / "submissions"
    for name in ("stays", "goes"):
        submission(submissions / name, GOOD)
    changes = {"play": "none", "trial_steps": 300}
    realbench(place, "round", "run", "submissions", rounds(place, **changes, repeats=2))
    realbench(place, "round", "run", "submissions", rounds(place, **changes, seed=1))
    for row in rows_of(place).values():
        assert row["files"] == ["seed1.json"]
    shutil.rmtree(submissions / "goes")
    path = rounds(place, play="none", trial_steps=400)
    realbench(place, "round", "run", "submissions", path, "--overwrite")
    rows = rows_of(place)
    assert (rows["stays"]["rank"], rows["stays"]["files"]) == (1, ["seed0.json"])
    assert (rows["goes"]["rank"], rows["goes"]["status"]) == (None, "waiting")
    assert "not tested in this round as it is now" in rows["goes"]["detail"]


def test_refused_run_changes_nothing(place: Path) -> None:
    submissions = place / "submissions"
    submission(submissions / "good", GOOD)
    submission(submissions / "crashing", derived(CRASHING), entry="controller.py:Crashing")
    realbench(place, "round", "run", "submissions", rounds(place, play="none", trial_steps=300))
    before = rows_of(place), (place / "results" / "first" / "round.json").read_bytes()
    path = rounds(place, play="none", trial_steps=400)
    done = realbench(place, "round", "run", "submissions", path, "--retry", code=1)
    assert re.search(r"good-[0-9a-f]{12}/seed0.json does not belong here", done.stderr)
    after = rows_of(place), (place / "results" / "first" / "round.json").read_bytes()
    assert after == before


def test_failed_submission_is_retried_on_request(place: Path) -> None:
    """Here one of memory, which counts zero, until the organisers allow more."""
    submission(place / "submissions" / "greedy", derived(MEMORY), entry="controller.py:Greedy")
    limits = {"memory_gib": 2, "call_s": 60, "total_s": 60}
    path = rounds(place, limits=limits, failure="zero", steps=1000)
    realbench(place, "round", "run", "submissions", path)
    row = rows_of(place)["greedy"]
    assert (row["status"], row["rank"]) == ("out of memory", 1)
    assert "MemoryError" in row["detail"]
    done = realbench(place, "round", "run", "submissions", path)
    assert "1 submission failed, and will not be run again without --retry" in done.stdout
    done = realbench(place, "round", "run", "submissions", path, "--retry")
    assert "without --retry" not in done.stdout
    assert "to run: 1 play and 1 test, " in done.stderr


def test_only_what_is_of_the_round_as_it_is_now_counts(
    place: Path, builtin_scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of results, what they learned from, and failures."""
    submissions = place / "submissions"
    submission(submissions / "good", GOOD)
    submission(submissions / "crashing", derived(CRASHING), entry="controller.py:Crashing")

    def held(**changes: Any) -> tuple[RoundRun, list[Entry]]:
        path = rounds(place, steps=1000, trial_steps=500, repeats=2, **changes)
        held = RoundRun(read_competition(path), "first", submissions)
        return held, held.prepare()

    def statuses(held: RoundRun, entries: list[Entry]) -> list[str]:
        return [standing.status for standing in held.settle(entries)]

    now, entries = held()
    assert [standing.status for standing in now.hold()[0]] == ["crashed", "scored"]
    home = now.home(entries[1])
    result, recording = home / "seed1.json", home / "seed1.h5"
    whole = result.read_bytes()
    forge(result, lambda content: content["setting"].update(learned=None))
    crashed, broken = now.settle(entries)
    assert (crashed.status, broken.status) == ("crashed", "broken rule")
    assert "some continued from what was learned at play" in broken.detail
    result.write_bytes(whole)
    assert statuses(now, entries) == ["crashed", "scored"]

    recording.rename(place / "elsewhere.h5")
    with pytest.raises(ExperimentError, match=r"seed1\.h5, which it learned from, is gone"):
        now.missing(entries)
    assert statuses(now, entries) == ["crashed", "waiting"]
    (place / "elsewhere.h5").rename(recording)

    with monkeypatch.context() as patched:
        patched.setattr(CONTROLS["M"], "version", 3)
        with pytest.raises(ExperimentError, match=r"seed0\.h5 does not .* have version 2, this"):
            now.missing(entries)

    other, entries = held(seed=1)
    pending = other.missing(entries)
    assert {job.name for job in pending.plays} == {"crashing-play2", "good-play2"}
    assert statuses(other, entries) == ["crashed", "waiting"]
    save_goal_set(generate_goal_set(builtin_scene, 1, 6, {"2D": 1}), place / "other.npy")
    other, entries = held(seed=1, goals="other.npy")
    pending = other.missing(entries, overwrite=True)
    assert {"crashing-test1", "crashing-test2"} < {job.name for job in pending.scorings}
    board = read_leaderboards(other.folder)[0]
    assert [row.standing.status for row in board.rows] == ["waiting", "waiting"]
    assert statuses(other, entries) == ["waiting", "waiting"]


def test_submissions_can_learn_from_given_recordings(place: Path) -> None:
    """All learn from the same ones: a test each."""
    play = ["--controller", "real_r", "--condition", "OM", "--scene", "builtin"]
    for seed in (1, 2):
        out = place / f"run{seed}.h5"
        realbench(place, "intrinsic", *play, "--steps", "3000", "--seed", seed, "--out", out)
    code = "from real_bench.controllers.real_d import RealD\n\n\nclass Mine(RealD):\n    pass\n"
    submission(place / "submissions" / "planner", code)
    path = rounds(place, play="given", recordings=["run1.h5", "run2.h5"], trial_steps=300)
    realbench(place, "round", "run", "submissions", path)
    row = rows_of(place)["planner"]
    assert row["status"] == "scored"
    assert row["summary"]["n_plays"] == 2
    again = ["--steps", "3000", "--seed", "3", "--out", place / "run2.h5", "--overwrite"]
    realbench(place, "intrinsic", *play, *again)
    changed = RoundRun(read_competition(path), "first", place / "submissions")
    entries = changed.prepare()
    changed.missing(entries, overwrite=True)  # the round is another one now
    assert [standing.status for standing in changed.settle(entries)] == ["waiting"]
    facts = load_round(changed.folder)
    results = sorted(changed.folder.glob("*/seed*.json"))
    assert [facts.includes(load_result(result)) for result in results] == [True, False]
    other = ["--controller", "real_r", "--condition", "OJ", "--scene", "builtin"]
    other += ["--objects", "2", "--steps", "1000", "--out", "run2.h5", "--overwrite"]
    realbench(place, "intrinsic", *other)
    refused = realbench(place, "round", "run", "submissions", path, code=1).stderr
    assert "run2.h5 does not fit this test: it has 2 objects, not 1" in refused
    assert "its condition is OJ, not OM" in refused


def test_package_index_that_does_not_answer_is_no_fault_of_a_submission(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It waits for it; one that was scored stays scored."""
    for name, value in (("INDEX_URL", "http://127.0.0.1:9/simple"), ("RETRIES", "1")):
        monkeypatch.setenv(f"PIP_{name}", value)
    submission(place / "submissions" / "needs", GOOD, requirements=["no-such-package-here"])
    held = RoundRun(read_competition(rounds(place)), "first", place / "submissions")
    (entry,) = held.prepare()
    assert (entry.folder, entry.standing.status) == (None, "waiting")
    assert "the package index cannot be reached" in entry.standing.detail
    assert not held.missing([entry]).scorings
    entry.standing.model_copy(update={"status": "scored"}).save(held.home(entry))
    assert [standing.status for standing in held.settle(held.prepare())] == ["scored"]


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"condition": "XX"}, "rounds.first.condition: "),
        ({"limits": {"memory_gib": -1}}, "--memory-limit must be above 0"),
        ({"limits": {"memory": 1}}, "rounds.first.limits: "),
        ({"play": "given"}, "recordings go with `play: given`"),
        ({"ties": "maybe"}, "rounds.first.ties: "),
        ({"seed": 2**63 - 2, "repeats": 3}, "rounds.first: it has seeds of 2**63 or more"),
        ({"goals": "none.npy"}, "none.npy"),
    ],
)
def test_bad_round_files_are_refused_before_work_begins(
    place: Path, changes: dict[str, Any], told: str
) -> None:
    submission(place / "submissions" / "good", GOOD)
    done = realbench(place, "round", "run", "submissions", rounds(place, **changes), code=1)
    assert told in done.stderr
    assert not list(place.glob("results/*/good-*"))


def test_missing_submissions_and_rounds_are_reported(place: Path) -> None:
    (place / "submissions").mkdir()
    path = rounds(place)
    done = realbench(place, "round", "run", "submissions", path, code=1)
    assert "no submission found in submissions" in done.stderr
    done = realbench(place, "round", "run", "submissions", path, "--round", "last", code=2)
    assert "has no round last: use first" in done.stderr
    done = realbench(place, "leaderboard", "submissions", code=1)
    assert "holds no round (`realbench round run` makes one)" in done.stderr


def test_results_of_a_changed_round_are_not_mixed(place: Path) -> None:
    submission(place / "submissions" / "good", GOOD)
    realbench(place, "round", "run", "submissions", rounds(place, steps=1000, trial_steps=500))
    path = rounds(place, steps=1000, trial_steps=600)
    done = realbench(place, "round", "run", "submissions", path, code=1)
    assert "trial steps 500, not 600" in done.stderr
    realbench(place, "round", "run", "submissions", path, "--overwrite")
    assert rows_of(place)["good"]["status"] == "scored"


def test_archive_that_leads_out_of_its_folder_is_refused(place: Path) -> None:
    """An archive that leads elsewhere is refused, and nothing is written there."""
    (place / "submissions").mkdir()
    with zipfile.ZipFile(place / "submissions" / "evil.zip", "w") as archive:
        archive.writestr("submission.yaml", "name: x")
        archive.writestr("../../escaped.py", "owned")
    realbench(place, "round", "run", "submissions", rounds(place))
    assert "leads out of its folder" in rows_of(place)["evil"]["detail"]
    assert not list(place.rglob("escaped.py"))


def test_rounds_held_at_the_same_time_share_the_copies_of_submissions(place: Path) -> None:
    for number in range(4):
        folder = submission(place / "submissions" / f"team{number}", GOOD)
        for file in range(100):
            (folder / f"data{file}").write_text(str(file))
    with ThreadPoolExecutor() as pool:
        for moment in range(3):
            begin = Barrier(4)
            results = place / f"results{moment}"

            def take_in(results: Path = results, begin: Barrier = begin) -> list[Entry]:
                begin.wait()
                return read_entries(place / "submissions", results, "OM")

            each = [future.result() for future in [pool.submit(take_in) for _ in range(4)]]
            assert all(entries == each[0] for entries in each)
            assert len(list((results / "submissions").iterdir())) == 4


@pytest.mark.parametrize("name", ["submissions", "Submissions"])
def test_round_cannot_have_the_name_of_what_results_hold(place: Path, name: str) -> None:
    submission(place / "handed-in" / "good", GOOD)
    spec = {"scene": "builtin", "rounds": {name: ROUND}}
    (place / "round.yaml").write_text(json.dumps(spec))
    done = realbench(place, "round", "run", "handed-in", "round.yaml", code=1)
    assert f"rounds: a round cannot be called {name}" in done.stderr
    assert not (place / "results").exists()


def test_results_cannot_be_where_submissions_are(place: Path) -> None:
    submission(place / "submissions" / "good", GOOD)
    submission(place / "first" / "good", GOOD)
    spec = {"scene": "builtin", "results": ".", "rounds": {"first": ROUND}}
    (place / "round.yaml").write_text(json.dumps(spec))
    done = realbench(place, "round", "run", "submissions", "round.yaml", code=1)
    assert "name other `results`" in done.stderr
    done = realbench(place, "round", "run", "first", "round.yaml", code=2)
    assert "first is the folder of round first" in done.stderr
    assert {path.name for path in (place / "submissions").iterdir()} == {"good"}
