"""What happens around a run that nobody wishes for; real ones, in real processes."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from real_bench.goal_sets import GoalSet, save_goal_set
from real_bench.recording import Recording
from real_bench.scoring.result import load_result
from tests.cli.shell import realbench
from tests.recording.bench import realbench as eager_realbench

PLAY = ["intrinsic", "--controller", "real_r", "--condition", "OM", "--scene", "builtin"]
TEST = ["extrinsic", "--controller", "real_r", "--condition", "OM", "--scene", "builtin"]


@contextmanager
def mounted(folder: Path, options: str) -> Iterator[Path]:
    """A file system in memory, as small or as unwilling as a test wants it."""
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", options, "none", str(folder)]
    if os.geteuid() != 0 or subprocess.run(command, check=False, capture_output=True).returncode:
        pytest.skip("only root may mount")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


@pytest.fixture
def goals_file(goals: GoalSet, tmp_path: Path) -> Path:
    path = tmp_path / "goals.npy"
    save_goal_set(goals, path)
    return path


@pytest.mark.parametrize("command", [[*PLAY, "--steps", "1000"], [*TEST, "--trials", "1"]])
def test_unwritable_folder_is_reported_before_work_begins(
    tmp_path: Path, goals_file: Path, command: list[str]
) -> None:
    more = ["--goals", goals_file] if command[0] == "extrinsic" else []
    with mounted(tmp_path / "locked", "ro") as folder:
        done = realbench(folder, *command, *more, code=1)
    assert "cannot write into" in done.stderr
    assert "Read-only file system" in done.stderr


def test_full_disk_stops_a_test_that_can_be_resumed_later(tmp_path: Path, goals_file: Path) -> None:
    told = [*TEST, "--trial-steps", "2000", "--goals", goals_file, "--resume"]
    realbench(tmp_path, *told, "--out", "whole.json")
    whole = load_result(tmp_path / "whole.json")
    with mounted(tmp_path / "small", "size=20k") as folder:
        (folder / "filling").write_bytes(bytes(16_000))  # one page of memory is left
        stopped = realbench(folder, *told, code=1)
        assert "No space left on device" in stopped.stderr
        kept = load_result(folder / "score.json").trials
        assert 0 < len(kept) < len(whole.trials)
        assert kept == whole.trials[: len(kept)]
        (folder / "filling").unlink()
        realbench(folder, *told)
        assert load_result(folder / "score.json").trials == whole.trials


def test_recording_removed_during_the_play_is_whole_in_the_end(tmp_path: Path) -> None:
    process = subprocess.Popen(
        eager_realbench(*PLAY, "--steps", 15_000, eager=True),
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    end = time.monotonic() + 60
    while not ((tmp_path / "run.h5").exists() and (tmp_path / ".run.h5.part").exists()):
        assert time.monotonic() < end
        time.sleep(0.01)
    (tmp_path / "run.h5").unlink()
    _, told = process.communicate(timeout=240)
    assert process.returncode == 0, told
    with Recording(tmp_path / "run.h5") as recording:
        assert len(recording.transitions) == 15
        assert recording.ended
