"""Progress as a log and a terminal show it."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from real_bench.goal_sets import save_goal_set
from real_bench.progress import display as progress
from real_bench.simulation import Scene
from tests.cli.shell import realbench, tiny_goals, write_controller

PLAY = ("intrinsic", "--scene", "builtin", "--condition", "OM", "--steps", "2000")
LEARNS = (
    "def use_experience(self, experience):",
    "    import time; time.sleep(3)",
    "def get_state(self): return {'learned': 1}",
    "def set_state(self, state): pass",
)


def test_log_shows_progress_line_by_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress, "SECONDS_BETWEEN_LINES", -1)
    with progress.ProgressDisplay("playing", "steps", 3000) as display:
        display.update(1000, "fast")
        display.update(2000, "")
    printed = capsys.readouterr()
    first, second = printed.err.splitlines()
    assert first == "playing: 1,000 of 3,000 steps, fast"  # no rate is known yet
    assert second.startswith("playing: 2,000 of 3,000 steps, about ")
    assert second.endswith(" s left")
    assert printed.out == ""


def test_short_work_logs_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with progress.ProgressDisplay("playing", "steps", 3) as display:
        display.update(1)
    assert capsys.readouterr().err == ""


def test_log_shows_what_a_controller_is_busy_with(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress, "SECONDS_BETWEEN_LINES", 0.5)
    with progress.ProgressDisplay("playing", "steps", 3000) as display:
        display.update(1000, "fast")
        with display.activity("learning"):
            time.sleep(2.5)
        assert display.note == "fast"
    assert "playing: 1,000 of 3,000 steps, learning, 0:0" in capsys.readouterr().err


@pytest.fixture
def learner(tmp_path: Path, builtin_scene: Scene) -> Path:
    """The folder of a controller that learns for three seconds."""
    write_controller(tmp_path / "learner.py", *LEARNS)
    save_goal_set(tiny_goals(builtin_scene), tmp_path / "goals.npy")
    return tmp_path


def test_terminal_shows_learning_in_play_and_tests(
    learner: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "120")
    play = (*PLAY, "--controller", "learner.py")
    assert "learning, 0:02" in realbench(learner, *play).stderr
    for jobs in ("1", "2"):
        test = ("extrinsic", "--goals", "goals.npy", "--jobs", jobs, "--overwrite")
        assert "learning, 0:01" in realbench(learner, *test, "--trial-steps", "500").stderr


def test_table_shows_which_controllers_are_learning(
    learner: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "160")
    (learner / "x.yaml").write_text(
        "{scene: builtin, steps: 2000, trial_steps: 500, goals: {few: goals.npy},"
        " cells: [{controller: learner.py, condition: OM}]}"
    )
    told = realbench(learner, "table", "x.yaml").stderr
    assert "now learner-OM-1-seed0 (learning)" in told
    assert "now learner-OM-1-seed0-few (learning)" in told


def test_no_progress_option_hides_progress(learner: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "120")
    play = (*PLAY, "--controller", "real_r", "--out")
    assert "playing real_r" in realbench(learner, *play, "a.h5").stderr
    told = realbench(learner, *play, "b.h5", "--no-progress").stderr
    assert "playing" not in told
    assert "\x1b" not in told
    assert "controller: class RealR" in told
