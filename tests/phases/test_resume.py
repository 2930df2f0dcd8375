"""Runs that are killed, interrupted, extended; each must go on as if nothing had happened."""

from __future__ import annotations

import contextlib
import random
import signal
import subprocess
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from real_bench.controller_code.source import ControllerSource
from real_bench.errors import ControllerError, RecordingError
from real_bench.recording import Recording, recorder
from real_bench.recording.writer import AppendOnlyFile
from real_bench.text.naming import shareable_name
from tests.phases.conftest import Play, toy
from tests.recording.bench import SCENE, has_grown, realbench, recorded_steps, run, start, wait_for

PLAY = ("intrinsic", "--controller", "real_r", "--condition", "OM", "--scene", SCENE, "--resume")
ENDLESS = realbench(*PLAY, "--steps", 15_000_000, eager=True)


def commands(path: Path) -> NDArray[np.float64]:
    with Recording(path) as recording:
        rows = recording.commands()
    return np.column_stack([rows["command"], rows["n_steps"]])


def check_every_command_was_given_once(resumed: Path, uninterrupted: Path) -> None:
    np.testing.assert_array_equal(commands(resumed), commands(uninterrupted))
    assert len(np.unique(commands(resumed), axis=0)) == len(commands(resumed))


def test_repeatedly_killed_run_misses_nothing(play: Play, tmp_path: Path) -> None:
    out, moments, ends = tmp_path / "run.h5", random.Random(7), set()
    kill_after(start(ENDLESS, tmp_path), moments.uniform(0.5, 1.8))  # perhaps before it plays
    for _ in range(3):
        begun = recorded_steps(out)
        process = start(ENDLESS, tmp_path)
        wait_for(process, partial(has_grown, out, begun))
        kill_after(process, moments.uniform(0, 0.2))
        ends.add(recorded_steps(out))
    whole, finished = resume_for(1500, play)
    assert "cut at" in finished.stdout
    with Recording(out) as recording, Recording(whole) as uninterrupted:
        assert ends <= set(recording.cuts)
        n_alike = recording.cuts[0] // 1000 + 1
        assert (recording.states[:n_alike] == uninterrupted.states[:n_alike]).all()
    assert {path.name for path in tmp_path.iterdir()} == {"run.h5", "whole.h5"}


def kill_after(process: subprocess.Popen[str], seconds: float) -> None:
    time.sleep(seconds)
    process.kill()
    process.communicate()


def resume_for(steps: int, play: Play) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """Resume the run, end it, and compare it with one that was never interrupted."""
    steps += recorded_steps(Path("run.h5"))
    finished = run([*ENDLESS, "--steps", str(steps)], Path.cwd())
    assert finished.returncode == 0, finished.stderr
    assert recorded_steps(Path("run.h5")) == steps
    whole = play("real_r", steps, out="whole.h5")
    check_every_command_was_given_once(Path("run.h5"), whole)
    return whole, finished


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stopped_run_says_how_to_resume(play: Play, number: signal.Signals) -> None:
    process = start(ENDLESS, Path.cwd())
    wait_for(process, lambda: recorded_steps(Path("run.h5")) > 0)
    process.send_signal(number)
    _, message = process.communicate()
    assert process.returncode == 130
    controller, message = message.splitlines()
    assert controller.startswith("controller: class ")
    assert "stopped at step" in message
    assert "--resume" in message
    resume_for(1500, play)


def test_play_that_goes_on_is_not_tested_and_a_stopped_one_is_told_from_a_whole(
    goals_path: Path, tmp_path: Path
) -> None:
    test = realbench("extrinsic", "--goals", goals_path, "--trial-steps", 1000)
    process = start(ENDLESS, tmp_path)
    wait_for(process, lambda: recorded_steps(tmp_path / "run.h5") > 0)
    refused = run(test, tmp_path)
    kill_after(process, 0)
    assert refused.returncode == 1
    assert "run.h5 is being played: test it when the play is over" in refused.stderr
    tested = run(test, tmp_path)
    assert tested.returncode == 0, tested.stderr
    n_steps = recorded_steps(tmp_path / "run.h5")
    assert f"run.h5 ends after {n_steps:,} of 15,000,000 steps" in tested.stderr


def test_play_killed_before_its_first_action_begins_anew(play: Play, tmp_path: Path) -> None:
    """With the code that plays then, not with that which was killed."""
    dies = "import os, signal\n\n\ndef die():\n    os.kill(os.getpid(), signal.SIGKILL)\n"
    code = Path(toy("series:Macros").partition(":")[0]).read_text()
    (tmp_path / "mine.py").write_text(
        f"{code}\n\n{dies}\n\nclass Mine(Macros):\n    def next_action(self, observation):\n"
        "        die()\n        return super().next_action(observation)\n"
    )
    command = realbench(*PLAY, "--controller", "mine.py:Mine", "--steps", "2000")
    assert run(command, tmp_path).returncode == -signal.SIGKILL
    assert recorded_steps(tmp_path / "run.h5") == 0
    mended = (tmp_path / "mine.py").read_text().replace("        die()\n", "")
    (tmp_path / "mine.py").write_text(mended)
    assert run(command, tmp_path).returncode == 0
    with Recording(tmp_path / "run.h5") as recording:
        assert (recording.n_steps, recording.cuts) == (2000, [])
        now = ControllerSource.of(f"{tmp_path}/mine.py:Mine").code_sha256
        assert recording.header.controller_sha256 == recording.code_sha256 == now


def test_pressing_ctrl_c_twice_loses_no_action(play: Play, tmp_path: Path) -> None:
    command = realbench(*PLAY, "--controller", toy("series:Impatient"), "--steps")
    assert run([*command, "20000000"], tmp_path).returncode == 130
    assert 0 < recorded_steps(tmp_path / "run.h5") <= 2000
    assert run([*command, "5000"], tmp_path).returncode == 0
    whole = play(toy("series:Macros"), 5000, out="whole.h5")
    check_every_command_was_given_once(tmp_path / "run.h5", whole)


def test_pressing_ctrl_c_twice_during_a_write_loses_nothing(
    play: Play, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "SECONDS_BETWEEN_WRITES", 0.0)
    controller = toy("series:InterruptedWhileItIsWritten")
    with pytest.raises(KeyboardInterrupt):
        play(controller, 4000)
    play(controller, 4000, resume=True)
    whole = play(toy("series:Macros"), 4000, out="whole.h5")
    check_every_command_was_given_once(Path("run.h5"), whole)


@pytest.mark.parametrize("step", ["_swap", "append"])
def test_pressing_ctrl_c_twice_just_after_a_write_loses_nothing(
    play: Play, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    done, presses = getattr(AppendOnlyFile, step), [signal.SIGINT] * 2

    def press(file: AppendOnlyFile, *given: Any) -> Any:
        outcome = done(file, *given)
        while presses:
            signal.raise_signal(presses.pop())
        return outcome

    monkeypatch.setattr(recorder, "SECONDS_BETWEEN_WRITES", 0.0)
    monkeypatch.setattr(AppendOnlyFile, step, press)
    with pytest.raises(KeyboardInterrupt):
        play("real_r", 4000)
    play("real_r", 4000, resume=True)
    check_every_command_was_given_once(Path("run.h5"), play("real_r", 4000, out="whole.h5"))


def test_resuming_a_finished_run_changes_nothing(play: Play) -> None:
    before = play("real_r", 2500).read_bytes()
    assert play("real_r", 2500, resume=True).read_bytes() == before


def test_finished_run_can_be_extended(play: Play) -> None:
    play(toy("series:Macros"), 2000)
    with Recording(play(toy("series:Macros"), 4500, resume=True)) as recording:
        assert recording.n_steps == recording.total_steps == 4500
        assert recording.cuts == [2000]
    whole = play(toy("series:Macros"), 4500, out="whole.h5")
    check_every_command_was_given_once(Path("run.h5"), whole)


def test_run_cannot_be_shortened(play: Play) -> None:
    before = play("real_r", 2500).read_bytes()
    with pytest.raises(RecordingError, match="2,500"):
        play("real_r", 2000, resume=True)
    assert Path("run.h5").read_bytes() == before


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("condition", "OJ"),
        ("objects", 2),
        ("seed", 1),
        ("controller", toy("series:Macros")),
        ("images", True),
    ],
)
def test_run_cannot_be_resumed_with_other_settings(play: Play, field: str, value: object) -> None:
    settings = {"controller": "real_r", "condition": "OM", "objects": 1, "seed": 0, "images": False}
    before = play(**settings, steps=1000).read_bytes()
    with pytest.raises(RecordingError) as caught:
        play(**{**settings, field: value}, steps=2000, resume=True)
    named, _, rest = (
        str(caught.value).partition("other settings and cannot be resumed: ")[2].partition(": ")
    )
    assert named == field
    assert repr(shareable_name(value) if isinstance(value, str) else value) in rest
    assert ";" not in rest or field == "condition"  # with it, the version of its control
    assert Path("run.h5").read_bytes() == before


def test_state_of_arrays_bytes_and_lists_is_resumed(play: Play) -> None:
    controller = toy("series:ManyKindsOfState")
    for steps in (2000, 3000, 6000):
        play(controller, steps, resume=True)
    check_every_command_was_given_once(Path("run.h5"), play(controller, 6000, out="whole.h5"))


def test_rows_and_state_match_however_rarely_state_is_taken(play: Play) -> None:
    controller = toy("series:SlowToHandOver")
    with pytest.raises(ControllerError, match="no idea"):
        play(controller, 8000)
    play(controller, 8000, resume=True)
    whole = play(toy("series:Macros"), 8000, out="whole.h5")
    check_every_command_was_given_once(Path("run.h5"), whole)


def test_stateless_controller_does_not_repeat_itself_when_resumed(play: Play) -> None:
    controller = toy("series:Forgetful")
    for steps in (2000, 4000, 6000):
        path = play(controller, steps, resume=True)
    assert len(np.unique(commands(path), axis=0)) == 6


def test_run_whose_end_failed_is_ended_on_resume(play: Play) -> None:
    controller = toy("series:FailsAtTheEnd")
    with pytest.raises(ControllerError, match="no room to learn"):
        play(controller, 2000)
    with Recording(play(controller, 2000, resume=True)) as recording:
        assert recording.controller_state()["learned"]


def test_simultaneous_resumes_do_not_mix(play: Play) -> None:
    """One of them may be refused, but no action may be recorded twice."""
    controller = toy("series:Overtaken")
    play(controller, 2000)
    Path("overtake").touch()
    with contextlib.suppress(RecordingError):
        play(controller, 4000, resume=True)
    play(controller, 4000, resume=True)
    check_every_command_was_given_once(Path("run.h5"), play(controller, 4000, out="whole.h5"))
