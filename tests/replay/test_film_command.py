"""Films of parts of a recording: what they show is what was recorded, to the pixel."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any
from unittest import mock

import av
import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

from real_bench.errors import RecordingError, SceneError
from real_bench.phases.film import STEPS_PER_FRAME
from real_bench.recording import Recording
from real_bench.replay import PartReplay
from real_bench.replay.part import Frame
from real_bench.replay.showing import show_part
from real_bench.simulation import Scene
from tests.cli.shell import realbench

LABEL_HEIGHT = 24


def ignore(done: int, total: int) -> None:
    assert 0 <= done <= total


@pytest.mark.parametrize(("first", "last"), [(0, 1), (1, 3), (2, 5), (4, 5)])
def test_any_part_is_replayed_bit_for_bit(recorded: Path, first: int, last: int) -> None:
    seen: dict[int, NDArray[np.uint8]] = {}
    numbers = []

    def look(shown: Frame) -> None:
        seen[shown.step] = shown.task.simulation.image().retina
        numbers.append(shown.number)
        assert shown.as_recorded

    assert PartReplay(recorded, first, last).run(look, 500, ignore)
    with Recording(recorded) as recording:
        rows, images = recording.transitions[first:last], recording.images()
    for row in rows:
        end = int(row["first_step"] + row["n_steps"])
        np.testing.assert_array_equal(seen[end], images[row["outcome"]])
    assert sorted(set(numbers)) == list(range(first, last))
    assert min(seen) == rows["first_step"][0]


def frames_of(path: Path) -> list[NDArray[Any]]:
    with av.open(str(path)) as opened:
        stream = opened.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        return [frame.to_ndarray(format="rgb24") for frame in opened.decode(stream)]


@pytest.mark.parametrize(
    ("asked", "first", "last"), [("1:3", 1, 3), ("-2:", 3, 5), ("3", 3, 4), (":1", 0, 1)]
)
def test_the_command_makes_a_labelled_film(
    recorded: Path, tmp_path: Path, asked: str, first: int, last: int
) -> None:
    done = realbench(tmp_path, "film", recorded, "--actions", asked, "--out", "a.mp4")
    assert done.stdout == f"film of actions {first} to {last - 1}: a.mp4\n"
    frames = frames_of(tmp_path / "a.mp4")
    with Recording(recorded) as recording:
        row = recording.transitions[last - 1]
        n_steps = int(recording.transitions["n_steps"][first:last].sum())
        end = recording.images()[row["outcome"]].astype(float)
    assert len(frames) == 1 + n_steps // STEPS_PER_FRAME
    assert all(frame.shape == (240 + LABEL_HEIGHT, 320, 3) for frame in frames)
    picture, label = frames[-1][LABEL_HEIGHT:].astype(float), frames[-1][:LABEL_HEIGHT]
    assert np.abs(picture - end).mean() < 5  # levels of 255: what compression may lose
    assert label.min() < 100 < 200 < label.max()  # something is written there


def test_film_of_a_short_recording_defaults_to_all_of_it(recorded: Path, tmp_path: Path) -> None:
    done = realbench(tmp_path, "film", recorded)
    assert done.stdout == "film of actions 0 to 4: play.mp4\n"
    assert (
        "play.mp4 exists: use --overwrite" in realbench(tmp_path, "film", recorded, code=1).stderr
    )
    realbench(tmp_path, "film", recorded, "--actions", "0", "--overwrite")


def test_replay_that_differs_is_reported(recorded: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    shutil.copy(recorded, path)
    with h5py.File(path, "r+") as file:
        rows = file["commands"][()]
        rows["command_0"][2:] += 0.1
        file["commands"][...] = rows
    done = realbench(tmp_path, "film", path, "--actions", "0:4")
    assert done.stdout.endswith("play.mp4; it differs from the recording\n")
    assert done.stderr.count("since action 2 objects are not where they were recorded") == 1


@pytest.mark.parametrize(
    ("arguments", "code", "complaint"),
    [
        (("--actions", "5:9"), 2, "has 5 actions, 0 to 4: --actions selects none"),
        (("--actions", "3:1"), 2, "--actions selects none"),
        (("--actions", "many"), 2, "'many' is not a range of actions like 10:20, 10:, -5: or 7"),
        (("--gui", "--out", "a.mp4"), 2, "--gui shows a window and writes no film"),
        (("--gui",), 1, "no display"),
        (("--scene", "moon"), 1, "unknown scene"),
        (("--out", "/proc/nope/a.mp4"), 1, "cannot write"),
    ],
)
def test_bad_film_arguments_give_a_one_line_error(
    recorded: Path, tmp_path: Path, arguments: tuple[str, ...], code: int, complaint: str
) -> None:
    with mock.patch.dict(os.environ):
        os.environ.pop("DISPLAY", None)
        done = realbench(tmp_path, "film", recorded, *arguments, code=code)
    assert complaint in done.stderr
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_file_that_is_no_recording_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run.h5").write_text("none")
    assert "not a recording" in realbench(tmp_path, "film", "run.h5", code=1).stderr


def test_a_recording_of_another_scene_is_not_replayed(
    recorded: Path, official_scene: Scene
) -> None:
    with pytest.raises(RecordingError, match="was made in scene builtin"):
        PartReplay(recorded, 0, 1, "official").run(print, 50, ignore)


def test_window_plays_in_real_time(recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a window: the clock and the display are replaced, the replay is not."""
    slept: list[float] = []
    real_run = PartReplay.run

    def without_window(self: PartReplay, *arguments: object, gui: bool) -> bool:
        assert gui
        return real_run(self, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(PartReplay, "run", without_window)
    monkeypatch.setattr("real_bench.replay.showing.time.monotonic", lambda: 10.0 + sum(slept))
    monkeypatch.setattr("real_bench.replay.showing.time.sleep", slept.append)
    assert show_part(PartReplay(recorded, 1, 2), ignore)
    assert sum(slept) == pytest.approx(1000 * 0.005)


@pytest.mark.skipif("DISPLAY" not in os.environ, reason="there is no display")
def test_a_part_is_shown_in_a_window(recorded: Path) -> None:
    try:
        assert show_part(PartReplay(recorded, 0, 1), ignore)
    except SceneError as error:
        pytest.skip(str(error))
