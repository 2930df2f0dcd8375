"""What an organiser meets: one command, one leaderboard, and nobody harmed."""

from __future__ import annotations

import json
import time
from pathlib import Path

from junitparser import Error, Failure, JUnitXml

from tests.cli.shell import realbench
from tests.competition.five import hand_in, rounds

STATUSES = {
    "good": "scored",
    "malicious": "broken rule",
    "hanging": "out of time",
    "crashing": "crashed",
    "missing": "refused",
}
TOLD = {
    "malicious": "play, a message from its process was refused: it declares 4294967295",
    "hanging": "play, next_action() did not end within the 12 s of --call-limit",
    "crashing": "test, goal 0: next_action() failed at controller.py, line ",
    "missing": "play, cannot be loaded: controller.py, line 1: ModuleNotFoundError",
}
LONGEST_S = 240  # three jobs a submission, of which one waits for the 12 s of its limit


def test_good_submission_scores_and_four_bad_ones_get_a_status(place: Path) -> None:
    victim = place / "victim"
    victim.write_text("whole")
    hand_in(place / "submissions", victim)
    began = time.monotonic()
    path = rounds(place)
    done = realbench(place, "round", "run", "submissions", path, "--jobs", "2", "--junit", "j.xml")
    assert time.monotonic() - began < LONGEST_S
    assert victim.read_text() == "whole"
    assert not list(place.rglob("touched"))
    assert "Traceback" not in done.stderr
    told = realbench(place, "leaderboard", "results", "--format", "json").stdout
    rows = json.loads(told)["first"]["rows"]
    assert {row["key"]: row["status"] for row in rows} == STATUSES
    assert [row["rank"] for row in rows] == [1, None, None, None, None]
    assert rows[0]["summary"]["metrics"]["score"]["mean"] > 0
    for row in rows[1:]:
        assert row["detail"].startswith(TOLD[row["key"]])
        assert str(place) not in row["detail"]
    cases = {
        case.name: case.result
        for suite in JUnitXml.fromfile(str(place / "j.xml"))
        for case in suite
    }
    kinds = {name: [type(result) for result in results] for name, results in cases.items()}
    assert kinds == {
        "Good": [],
        "Malicious": [Error],
        "Hanging": [Error],
        "Crashing": [Error],
        "Missing": [Failure],
    }
    again = realbench(place, "round", "run", "submissions", path)
    assert "to run" not in again.stderr
    assert again.stdout == done.stdout
