from __future__ import annotations

import resource
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from real_bench.errors import RealBenchError
from real_bench.files.atomic import OutputError
from real_bench.goal_sets import GoalSet
from real_bench.phases import film
from real_bench.phases.film import STEPS_PER_FRAME
from real_bench.phases.trial import TrialMaker
from tests.outside.bench import after_first_line
from tests.phases.conftest import FaceGoals
from tests.recording.bench import SCENE, realbench, start

TRIAL_STEPS = 1030
LABEL_HEIGHT = 24


def test_filming_and_drawing_change_no_score(face_goals: FaceGoals, goals: GoalSet) -> None:
    folders = {"videos": Path("films"), "pictures": Path("pictures")}
    film_trial = face_goals("real_r", n_trials=2, trial_steps=TRIAL_STEPS, **folders)
    plain = face_goals("real_r", n_trials=2, trial_steps=TRIAL_STEPS, out="plain.json")
    assert film_trial.trials == plain.trials
    height, width = goals.goals[0].mask.shape
    for number in film_trial.setting.goal_numbers:
        check_film(Path("films") / f"trial-{number:02d}.mp4", goals.goals[number].retina)
        with Image.open(Path("pictures") / f"trial-{number:02d}.png") as picture:
            picture.load()
            assert picture.width >= 3 * width
            assert picture.height >= height


def check_film(path: Path, goal: np.ndarray) -> None:
    with av.open(str(path)) as opened:
        stream = opened.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        frames = [frame.to_ndarray(format="rgb24") for frame in opened.decode(stream)]
    assert len(frames) == 1 + TRIAL_STEPS // STEPS_PER_FRAME
    height, width, _ = goal.shape
    assert all(frame.shape == (LABEL_HEIGHT + height, 2 * width, 3) for frame in frames)
    beside = frames[-1][LABEL_HEIGHT:, width:].astype(float)
    assert np.abs(beside - goal).mean() < 10  # levels of 255: what compression may lose
    assert np.abs(frames[0].astype(float) - frames[-1]).max() > 50  # something moved


def limit_files_to_20_kb() -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))


def test_unwritable_film_gives_a_one_line_error(goals_path: Path, tmp_path: Path) -> None:
    test = ("extrinsic", "--controller", "real_r", "--condition", "OM", "--scene", SCENE)
    more = ("--trial-steps", "4000", "--goals", str(goals_path), "--video", "films")
    command = realbench(*test, *more, eager=True)
    process = start(command, tmp_path, limit_files_to_20_kb)
    _, message = process.communicate()
    assert process.returncode == 1
    fault = after_first_line(message)
    assert fault.startswith("realbench: error: cannot write")
    assert fault.count("\n") == 1


def test_folder_name_with_a_colon_is_not_taken_for_a_protocol(face_goals: FaceGoals) -> None:
    """FFmpeg takes what stands before a colon for a protocol."""
    folder = Path("2026-01-01T12:00:00")
    face_goals("real_r", n_trials=1, trial_steps=100, videos=folder)
    with av.open(f"file:{folder}/trial-00.mp4") as film:
        assert film.streams.video


def never(*_: object) -> None:
    raise AssertionError("something was learned before")


@pytest.mark.parametrize("what", ["videos", "pictures", "explanations"])
@pytest.mark.parametrize("folder", ["/proc/nope", "taken"])
def test_film_and_picture_folders_are_checked_before_work_begins(
    face_goals: FaceGoals, monkeypatch: pytest.MonkeyPatch, what: str, folder: str
) -> None:
    Path("taken").write_text("a file")
    monkeypatch.setattr(TrialMaker, "__init__", never)
    with pytest.raises(OutputError, match=f"cannot write into {folder}"):
        face_goals("real_r", n_trials=1, **{what: Path(folder)})
    assert not Path("score.json").exists()


def test_ffmpeg_that_cannot_encode_is_reported_before_work_begins(
    face_goals: FaceGoals, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(TrialMaker, "__init__", never)
    monkeypatch.setattr(film, "CODEC", "libx265-of-another-build")
    with pytest.raises(RealBenchError, match=r"cannot make films: .* has no libx265-of-another"):
        face_goals("real_r", n_trials=1, videos=Path("films"))


def test_missing_encoder_raises_a_clear_error(
    goals: GoalSet, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(film, "CODEC", "libx265-of-another-build")
    with pytest.raises(RealBenchError, match=r"cannot write .*film\.mp4"):
        film.Film(tmp_path / "film.mp4").add(goals.goals[0].retina)
    assert not list(tmp_path.iterdir())
