"""`realbench watch` beside a real play."""

from __future__ import annotations

import json
import os
import pty
import shutil
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from real_bench.recording import Recording
from real_bench.watching import follow, read_status
from real_bench.watching.curves import ASCII, BLOCKS, bin_means, curve
from tests.cli.shell import COMMAND, heed_ctrl_c, realbench
from tests.phases.conftest import toy
from tests.recording.bench import realbench as command
from tests.recording.bench import recorded_steps, start, wait_for

LOGS = toy("logs:Logs")
PLAY = ("intrinsic", "--controller", LOGS, "--condition", "OM", "--scene", "builtin")


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("played")
    realbench(folder, *PLAY, "--steps", "4000")
    return folder


def test_a_growing_recording_is_followed_to_its_end(tmp_path: Path) -> None:
    play = start(command(*PLAY, "--steps", 12_000, eager=True), tmp_path)
    wait_for(play, lambda: recorded_steps(tmp_path / "run.h5") > 0)
    watch = start(command("watch", "--json", "--every", "0.05"), tmp_path)
    output, faults = watch.communicate(timeout=200)
    assert watch.returncode == 0, faults
    assert play.wait(60) == 0
    told = [json.loads(line) for line in output.splitlines()]
    assert len(told) > 2
    steps = [one["steps"] for one in told]
    assert steps == sorted(steps)
    assert {one["state"] for one in told[:-1]} <= {"playing", "learning"}
    assert told[-1]["state"] == "ended"
    assert told[-1]["actions"] == told[-1]["logged"]["actions"] == 12
    assert all(one["logged"].get("actions", 0) == one["actions"] for one in told)
    assert any(one["steps_a_second"] for one in told)
    assert any(one["seconds_left"] for one in told)
    with Recording(tmp_path / "run.h5") as recording:
        assert told[-1]["share_of_actions_that_moved_an_object"] == recording.share_moved()


def test_play_that_has_just_been_started_is_waited_for(played: Path, tmp_path: Path) -> None:
    watch = start(command("watch", "--json"), tmp_path)
    assert watch.stderr is not None
    assert watch.stderr.readline().strip() == "waiting for run.h5"
    shutil.copy(played / "run.h5", tmp_path / "coming.h5")
    (tmp_path / "coming.h5").rename(tmp_path / "run.h5")
    output, faults = watch.communicate(timeout=200)
    assert watch.returncode == 0, faults
    assert json.loads(output.splitlines()[-1])["state"] == "ended"


def test_killed_play_is_reported_as_stopped(tmp_path: Path) -> None:
    play = start(command(*PLAY, "--steps", 15_000_000, eager=True), tmp_path)
    wait_for(play, lambda: recorded_steps(tmp_path / "run.h5") > 0)
    assert read_status(tmp_path / "run.h5").what == "playing"
    play.kill()
    play.communicate()
    assert read_status(tmp_path / "run.h5").what == "stopped"
    done = realbench(tmp_path, "watch", "run.h5")
    assert done.stdout.startswith("stopped: ")
    assert done.stdout.count("\n") == 1


def test_ctrl_c_ends_the_watch_but_not_the_play(tmp_path: Path) -> None:
    play = start(command(*PLAY, "--steps", 15_000_000, eager=True), tmp_path)
    wait_for(play, lambda: recorded_steps(tmp_path / "run.h5") > 0)
    watch = start(command("watch"), tmp_path, heed_ctrl_c)
    assert watch.stdout is not None
    assert watch.stdout.readline().startswith("playing: ")
    watch.send_signal(signal.SIGINT)
    _, faults = watch.communicate(timeout=60)
    assert (watch.returncode, faults) == (0, "")
    before = recorded_steps(tmp_path / "run.h5")
    wait_for(play, lambda: recorded_steps(tmp_path / "run.h5") > before)
    play.kill()
    play.communicate()


def test_terminal_shows_curves(played: Path) -> None:
    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "90", "LINES": "40"}
    process = subprocess.Popen(
        [COMMAND, "watch", "run.h5"], cwd=played, stdout=theirs, stderr=theirs, env=environment
    )
    os.close(theirs)
    shown = b""
    while True:
        try:
            part = os.read(ours, 1 << 16)
        except OSError:  # so Linux tells that the other end is closed
            break
        if not part:
            break
        shown += part
    assert process.wait() == 0
    text = shown.decode()
    assert "run.h5: Logs, OM, 1 object, scene builtin, seed 0" in text
    assert "4,000 of 4,000 steps (100%)" in text
    assert "verlust ö" in text
    assert "█" in text


def test_tensorboard_reads_the_event_files(played: Path) -> None:
    accumulator = pytest.importorskip(
        "tensorboard.backend.event_processing.event_accumulator"
    ).EventAccumulator
    realbench(played, "watch", "run.h5", "--tensorboard", "events")
    events = accumulator(str(played / "events"))
    events.Reload()
    from tensorboard.util.tensor_util import make_ndarray

    assert {"logged/actions", "logged/epoch", "logged/verlust ö"} <= set(events.Tags()["tensors"])
    told = events.Tensors("logged/actions")
    assert [event.step for event in told] == [1000, 2000, 3000, 4000]
    assert [float(make_ndarray(event.tensor_proto)) for event in told] == [1, 2, 3, 4]
    again = realbench(played, "watch", "run.h5", "--tensorboard", "events", code=1)
    assert "events already has event files: use --overwrite" in again.stderr
    realbench(played, "watch", "run.h5", "--tensorboard", "events", "--overwrite")
    (before,) = (played / "events").iterdir()
    misspelt = ("none.h5", "--once", "--tensorboard", "events", "--overwrite")
    realbench(played, "watch", *misspelt, code=1)
    assert list((played / "events").iterdir()) == [before]


@pytest.mark.parametrize(
    ("arguments", "code", "complaint"),
    [
        (("none.h5", "--once"), 1, "recording not found: none.h5"),
        (("run.h5", "--every", "0"), 2, "'--every'"),
        (("run.h5", "--overwrite"), 2, "--overwrite needs --tensorboard"),
        (("run.h5", "--tensorboard", "run.h5"), 1, "run.h5"),
    ],
)
def test_bad_watch_arguments_give_a_one_line_error(
    played: Path, arguments: tuple[str, ...], code: int, complaint: str
) -> None:
    done = realbench(played, "watch", *arguments, code=code)
    assert complaint in done.stderr
    assert done.stderr.count("\n") == 1


def test_leftover_lock_is_not_taken_for_a_running_play(played: Path) -> None:
    path = played / "run.h5"
    lock = played / ".run.h5.lock"
    lock.touch()  # as a process that was killed leaves it
    assert not read_status(path).is_played
    lock.unlink()
    moments = list(follow(path, 0.0))
    assert [moment.status.what for moment in moments] == ["ended"]
    assert moments[0].speed is None


@given(
    st.lists(st.floats(allow_infinity=False) | st.just(np.nan), min_size=1, max_size=40),
    st.integers(1, 6),
    st.sampled_from([BLOCKS, ASCII]),
)
def test_curve_is_higher_where_its_value_is_higher(
    values: list[float], height: int, letters: str
) -> None:
    given = np.clip(np.array(values), -1e300, 1e300) / 2
    low, high = np.nanmin([*given, 0]), np.nanmax([*given, 0])
    lines = curve(given, height, low, high, letters)
    assert len(lines) == height
    assert {len(line) for line in lines} == {len(values)}
    drop_empty_columns = [
        sum(letters.index(line[column]) for line in lines) for column in range(len(values))
    ]
    for one, first in zip(given, drop_empty_columns, strict=True):
        assert (first == 0) == bool(np.isnan(one))
        for other, second in zip(given, drop_empty_columns, strict=True):
            if one < other:
                assert first <= second


@given(st.lists(st.tuples(st.integers(1, 1000), st.floats(-9, 9)), max_size=50), st.integers(1, 30))
def test_bins_hold_the_mean_of_their_values(points: list[tuple[int, float]], n_bins: int) -> None:
    steps, values = [step for step, _ in points], [value for _, value in points]
    means = bin_means(steps, values, 1000, n_bins)
    assert means.shape == (n_bins,)
    for number, mean in enumerate(means):
        mine = [v for s, v in points if min(int(s * n_bins / 1000), n_bins - 1) == number]
        np.testing.assert_allclose(mean, np.mean(mine) if mine else np.nan, atol=1e-9)
