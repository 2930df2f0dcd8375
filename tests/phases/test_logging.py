"""Numbers that a controller logs: kept with the actions that they belong to."""

from __future__ import annotations

import re
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from real_bench.errors import ControllerError
from real_bench.logbook import MAX_ENTRIES, MAX_NAME_LENGTH, add_entry, take_entries
from real_bench.recording import Recording
from tests.phases.conftest import FaceGoals, Play, toy
from tests.recording.bench import SCENE, has_grown, realbench, recorded_steps, start, wait_for

LOGS = toy("logs:Logs")
PLAY = ("intrinsic", "--controller", LOGS, "--condition", "OM", "--scene", SCENE, "--resume")


def noted(path: object) -> list[tuple[int, int, str, float]]:
    with Recording(str(path)) as recording:
        rows: list[tuple[int, int, str, float]] = recording.logged.tolist()
    return rows


def test_each_number_is_recorded_with_its_action(play: Play) -> None:
    rows = noted(play(LOGS, 3300))
    assert rows[0] == (1000, 1, "begun", 1.0)
    ends = [1000, 2000, 3000, 3300]
    assert [row for row in rows if row[2] == "actions"] == [
        (end, number, "actions", float(number)) for number, end in enumerate(ends, 1)
    ]
    losses = [row for row in rows if row[2] == "verlust ö"]
    assert [row[:2] for row in losses] == [(1000, 1), (3000, 3)]
    assert losses[0][3] == 1
    assert np.isnan(losses[1][3])
    assert [row for row in rows if row[2] == "epoch"] == [
        (3300, 4, "epoch", float(epoch)) for epoch in range(3)
    ]


@pytest.mark.parametrize("controller", [LOGS, toy("logs:AllAttributes")])
def test_resumed_run_continues_the_log(play: Play, controller: str) -> None:
    play(controller, 2000)
    rows = noted(play(controller, 4000, resume=True))
    assert [row[:2] for row in rows if row[2] == "actions"] == [
        (1000 * number, number) for number in range(1, 5)
    ]


def test_killed_run_neither_loses_nor_repeats_numbers(play: Play, tmp_path) -> None:
    out = tmp_path / "run.h5"
    for _ in range(2):
        begun = recorded_steps(out)
        process = start(realbench(*PLAY, "--steps", 15_000_000, eager=True), tmp_path)
        wait_for(process, partial(has_grown, out, begun))
        process.kill()
        process.communicate()
    n_actions = recorded_steps(out) // 1000 + 2
    rows = noted(play(LOGS, 1000 * n_actions, resume=True))
    assert [row[3] for row in rows if row[2] == "actions"] == list(range(1, n_actions + 1))


def test_only_the_last_of_too_many_numbers_are_kept(play: Play) -> None:
    rows = noted(play(toy("logs:Endless"), 2000))
    assert len(rows) == 2 * MAX_ENTRIES
    assert [row[3] for row in rows[:MAX_ENTRIES]] == list(range(20_000, 30_000))


@pytest.mark.parametrize(
    ("controller", "complaint"),
    [
        ("LongName", r"logs.py, line \d+: ValueError: a name must be 1 to 64 printable bytes"),
        ("NoNumber", r"logs.py, line \d+: ValueError: could not convert string to float"),
    ],
)
def test_bad_name_or_number_is_reported_with_its_line(
    play: Play, controller: str, complaint: str
) -> None:
    with pytest.raises(ControllerError, match=complaint):
        play(toy(f"logs:{controller}"), 1000)


def test_own_log_method_of_a_controller_is_left_alone(play: Play) -> None:
    assert noted(play(toy("logs:OwnLog"), 1000)) == []


def test_logging_changes_no_trial(face_goals: FaceGoals) -> None:
    logs = face_goals(LOGS, n_trials=1, trial_steps=1000)
    plain = face_goals("real_r", n_trials=1, trial_steps=1000, out="plain.json")
    assert logs.trials == plain.trials


class Noter:
    pass


@given(st.lists(st.tuples(st.text(max_size=80), st.floats()), max_size=20))
def test_entries_taken_are_those_added(entries: list[tuple[str, float]]) -> None:
    controller, kept = Noter(), []
    for name, value in entries:
        if name.isprintable() and 1 <= len(name.encode()) <= MAX_NAME_LENGTH:
            add_entry(controller, name, value)
            kept.append((name, value))
        else:
            with pytest.raises(ValueError, match=re.escape("a name must be")):
                add_entry(controller, name, value)
    np.testing.assert_equal(take_entries(controller), kept)
    assert take_entries(controller) == []
