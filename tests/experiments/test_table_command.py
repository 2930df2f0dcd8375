from __future__ import annotations

import json
import random
import signal
import subprocess
from pathlib import Path
from typing import Any

import pytest

from real_bench.goal_sets import shipped_goal_set
from tests.cli.shell import (
    COMMAND,
    TOUCHES,
    heed_ctrl_c,
    killed_at_work,
    realbench,
    write_controller,
)
from tests.experiments.conftest import Finished, WriteSpec
from tests.recording.bench import wait_for

FORGETFUL = """
from real_bench.actions import Action
from real_bench.controller import Controller

class Forgetful(Controller):
    def next_action(self, observation):
        return Action.rest(4)
"""


def test_finished_table_is_printed_again_without_work(finished: Finished) -> None:
    assert "to run: 2 plays and 5 tests, 9,000 steps in total" in finished.stderr
    assert "2 of 2" in finished.stdout
    again = finished.print()
    assert again.stdout == finished.stdout
    assert "to run" not in again.stderr
    assert finished.print("--format", "markdown").stdout.startswith("### tiny\n")
    assert r"\begin{tabular}" in finished.print("--format", "latex").stdout
    assert len(finished.table["rows"]) == 3


def test_spec_with_run_false_starts_nothing(write_spec: WriteSpec, tmp_path: Path) -> None:
    path = write_spec(run=False)
    done = realbench(tmp_path, "table", path)
    assert "missing: 2 plays and 5 tests, 9,000 steps in total" in done.stderr
    assert "5 of 5 repeats are missing" in done.stdout
    assert not (tmp_path / "results").exists()


def test_killed_table_resumes_to_the_same_table(
    finished: Finished, write_spec: WriteSpec, tmp_path: Path
) -> None:
    path = write_spec()
    moments = random.Random(7)
    killed = [
        killed_at_work(
            tmp_path,
            *("table", path),
            results=tmp_path / "results",
            pause_s=moments.uniform(0, 0.3),
        )
        for _ in range(3)
    ]
    assert any(killed)
    assert json.loads(realbench(tmp_path, "table", path, "--json").stdout) == finished.table


def test_ctrl_c_stops_and_says_how_to_continue(write_spec: WriteSpec, tmp_path: Path) -> None:
    path = write_spec(steps=100_000_000)
    process = subprocess.Popen(
        [str(COMMAND), "table", str(path)],
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heed_ctrl_c,
    )
    wait_for(process, lambda: bool(list((tmp_path / "results").glob("*.h5"))))
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "repeat the command to continue" in told


def test_failing_controller_does_not_stop_the_others(write_spec: WriteSpec, tmp_path: Path) -> None:
    body = (
        "n = 0",
        "def next_action(self, observation):",
        "    self.n += 1",
        "    if self.n > 1: raise ValueError('no idea')",
        "    return super().next_action(observation)",
    )
    write_controller(tmp_path / "bad.py", *body)
    cells: list[dict[str, Any]] = [
        {"controller": "bad.py", "condition": "OM"},
        {"controller": "real_r", "condition": "OM", "play": "none"},
    ]
    done = realbench(tmp_path, "table", write_spec(cells=cells, repeats=1), code=1)
    assert "bad-OM-1-seed0: controller" in done.stderr
    assert "no idea" in done.stderr
    assert "1 of 1" in done.stdout


def test_controllers_can_be_isolated(write_spec: WriteSpec, tmp_path: Path) -> None:
    """In the plays, in the tests, and when the table is only printed."""
    write_controller(tmp_path / "mine.py", *TOUCHES)
    path = write_spec(cells=[{"controller": "mine.py", "condition": "OM"}], repeats=1)
    done = realbench(tmp_path, "table", path, "--isolate")
    assert "the controller is isolated by " in done.stderr
    assert realbench(tmp_path, "table", path, "--isolate").stdout == done.stdout
    assert not (tmp_path / "touched").exists()
    isolated = json.loads(realbench(tmp_path, "table", path, "--json").stdout)["rows"]
    assert not (tmp_path / "touched").exists()  # printing a table runs nobody
    path = write_spec(cells=[{"controller": "mine.py", "condition": "OM"}], repeats=1, results="x")
    assert json.loads(realbench(tmp_path, "table", path, "--json").stdout)["rows"] == isolated
    assert (tmp_path / "touched").exists()


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"cells": [{"controller": "mien.py", "condition": "OM"}]}, "mien.py"),
        ({"cells": [{"controller": "real_q", "condition": "OM"}]}, "unknown controller 'real_q'"),
        ({"goals": {"few": str(shipped_goal_set(1))}}, "the goals were made in scene official"),
    ],
)
def test_mistakes_are_reported_before_work_begins(
    write_spec: WriteSpec, tmp_path: Path, changes: dict[str, Any], told: str
) -> None:
    done = realbench(tmp_path, "table", write_spec(**changes), code=1)
    assert told in done.stderr
    assert "to run" not in done.stderr


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("def next_action(self, observation): raise ValueError('no idea')", "no idea"),
        (
            "def next_action(self, observation): import os; os._exit(7)",
            "bad-OM-1-seed0: its process",
        ),
        ("def set_state(self, state): pass", "set_state(get_state()) gives another state"),
    ],
)
def test_unusable_controller_is_refused_before_work_begins(
    write_spec: WriteSpec, tmp_path: Path, body: str, told: str
) -> None:
    write_controller(tmp_path / "bad.py", body)
    cells = [
        {"controller": "real_r", "condition": "OM"},
        {"controller": "bad.py", "condition": "OM"},
    ]
    done = realbench(tmp_path, "table", write_spec(cells=cells, repeats=1), code=1)
    assert "before any work: " in done.stderr
    assert told in done.stderr
    assert "to run" not in done.stderr
    assert not list((tmp_path / "results").glob("*.h5"))


def test_missing_images_are_reported_before_work_begins(
    write_spec: WriteSpec, tmp_path: Path
) -> None:
    cells = [{"controller": "real_ld", "condition": "IM", "play": "random"}]
    done = realbench(tmp_path, "table", write_spec(cells=cells, repeats=1), code=1)
    assert "play random-1-seed0 records none: give that play `images: true`" in done.stderr


def test_two_tables_cannot_share_a_folder(write_spec: WriteSpec, tmp_path: Path) -> None:
    from real_bench.files.locks import write_lock

    path = write_spec()
    (tmp_path / "results").mkdir()
    with write_lock(tmp_path / "results" / "table"):
        done = realbench(tmp_path, "table", path, code=1)
    assert "another process" in done.stderr


@pytest.mark.parametrize("scheduler", ["tcp://127.0.0.1:9", "nonsense://x"])
def test_unreachable_scheduler_is_reported(
    write_spec: WriteSpec, tmp_path: Path, scheduler: str
) -> None:
    done = realbench(tmp_path, "table", write_spec(), "--scheduler", scheduler, code=1)
    assert f"no Dask scheduler answers at {scheduler}" in done.stderr


THRESHOLDS = """
title: written as people write
results: results
scene: builtin
steps: 1000
trial_steps: 500
goals: {few: {seed: 5, counts: {2D: 1}}}
cells:
- {controller: real_t, condition: OM, settings: {thresholds: [2e-2, "4e-2"]}}
- {controller: mine.py, condition: OM, play: none, settings: {steps: "50", deep: {on: "yes"}}}
"""
MINE = """
from real_bench.actions import Action
from real_bench.controller import Controller
from real_bench.settings import Settings

class Deep(Settings):
    on: bool = False

class MySettings(Settings):
    steps: int = 1
    deep: Deep = Deep()

class Mine(Controller):
    Settings = MySettings
    def __init__(self, action_space, observation_space, settings):
        super().__init__(action_space, observation_space)
    def next_action(self, observation):
        return Action.macro([[-0.1, 0.2], [-0.1, -0.2]])
"""


def test_settings_are_compared_as_controllers_parse_them(tmp_path: Path) -> None:
    """The work is done once, its table is printed, and there is nothing left to do."""
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "x.yaml").write_text(THRESHOLDS)
    done = realbench(tmp_path, "table", "x.yaml", "--json", "--jobs", "2")
    rows = json.loads(done.stdout)["rows"]
    assert [row["seeds_done"] for row in rows] == [[0], [0]]
    again = realbench(tmp_path, "table", "x.yaml", "--json")
    assert json.loads(again.stdout)["rows"] == rows
    assert "to run" not in again.stderr
    changed = THRESHOLDS.replace('"50"', '"51"')
    (tmp_path / "x.yaml").write_text(changed)
    other = realbench(tmp_path, "table", "x.yaml", "--no-run", code=1)
    assert "does not belong here: settings" in other.stderr


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"thresholds": ["low", "high"]}, "bad settings: thresholds.0: "),
        ({"treshold": 1}, "bad settings: treshold: "),
    ],
)
def test_settings_are_checked_before_work_begins(
    write_spec: WriteSpec, tmp_path: Path, settings: dict[str, Any], told: str
) -> None:
    cells = [
        {"controller": "real_r", "condition": "OM"},
        {"controller": "real_t", "condition": "OM", "settings": settings},
    ]
    done = realbench(tmp_path, "table", write_spec(cells=cells), code=1)
    assert told in done.stderr
    assert "to run" not in done.stderr
    assert "drawing" not in done.stderr
    assert not list((tmp_path / "results").glob("[!.]*"))


def test_play_whose_learning_would_be_lost_is_not_begun(
    write_spec: WriteSpec, tmp_path: Path
) -> None:
    (tmp_path / "forgetful.py").write_text(FORGETFUL)
    cell: dict[str, Any] = {"controller": "forgetful.py", "condition": "OM"}
    done = realbench(tmp_path, "table", write_spec(cells=[cell], repeats=1), code=1)
    assert "what it learns at play is lost" in done.stderr
    assert "give its cell `play: none`" in done.stderr
    assert not list((tmp_path / "results").glob("*.h5"))
    cell["play"] = "none"
    realbench(tmp_path, "table", write_spec(cells=[cell], repeats=1))


def test_hanging_controller_is_stopped_at_its_call_limit(
    write_spec: WriteSpec, tmp_path: Path
) -> None:
    before = "import time"
    write_controller(
        tmp_path / "idle.py", "def next_action(self, observation): time.sleep(1e6)", before=before
    )
    cells: list[dict[str, Any]] = [
        {"controller": "idle.py", "condition": "OM"},
        {"controller": "real_r", "condition": "OM", "play": "none"},
    ]
    path = write_spec(cells=cells, repeats=1)
    done = realbench(tmp_path, "table", path, "--isolate", "--call-limit", "10", code=1)
    assert "next_action() did not end within the 10 s of --call-limit" in done.stderr
    assert "1 of 1" in done.stdout
    refused = realbench(tmp_path, "table", path, "--call-limit", "10", code=2)
    assert "limits are for isolated controllers" in refused.stderr
