"""Recordings: what was played verifies, what was altered does not."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from real_bench.errors import Interrupted, RealBenchError, RecordingError
from real_bench.recording import Recording
from real_bench.simulation import Scene
from real_bench.verification import RecordingVerdict, RecordingVerification
from tests.phases.conftest import toy
from tests.recording.bench import edited_poses
from tests.verification.conftest import CUT_AT, RUN_STEPS, play

STOPPED = '''
import signal
from pathlib import Path
from real_bench.actions import Action
from real_bench.controller import Controller

class Stopped(Controller):
    """Is told to stop before its first action, where there is a file named stop."""
    def start_intrinsic_phase(self):
        if Path("stop").exists():
            signal.raise_signal(signal.SIGINT)
    def next_action(self, observation):
        return Action.macro([[-0.1, 0.2], [-0.1, -0.2]])
'''


def verify(path: Path, **options: Any) -> RecordingVerdict:
    return RecordingVerification(path, **options).verify(ignore_two)


def ignore_two(done: int, total: int) -> None:
    assert 0 <= done <= total


def test_a_resumed_recording_verifies_with_its_images(recorded: Path) -> None:
    verdict = verify(recorded, images=True)
    assert verdict.holds
    assert (verdict.n_actions, verdict.n_steps, verdict.n_states) == (5, RUN_STEPS, 7)
    assert verdict.lines() == [
        "verified: 4,500 of 4,500 steps replay bit for bit "
        "(5 actions, 7 states: joints, touch, poses and images)"
    ]


@pytest.mark.parametrize(
    ("controller", "condition"),
    [
        ("real_r", "OJ"),
        ("real_r", "OC"),
        (toy("series:StepMacros"), "OM"),
        (toy("tested:GlobalRandomness"), "OJ"),
    ],
)
def test_every_control_verifies(
    builtin_scene: Scene, tmp_path: Path, controller: str, condition: str
) -> None:
    for steps in (600, 1800):
        path = play(
            builtin_scene, tmp_path / "run.h5", steps, controller=controller, condition=condition
        )
    verdict = verify(path)
    assert verdict.holds
    assert verdict.n_steps == 1800


def test_a_run_that_was_resumed_and_stopped_at_once_verifies(
    builtin_scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("stopped.py").write_text(STOPPED)
    play(builtin_scene, Path("run.h5"), 2000, controller="stopped.py")
    Path("stop").touch()
    for _ in range(2):
        with pytest.raises(Interrupted):
            play(builtin_scene, Path("run.h5"), 4000, controller="stopped.py")
    Path("stop").unlink()
    play(builtin_scene, Path("run.h5"), 4000, controller="stopped.py")
    with Recording(Path("run.h5")) as recording:
        assert recording.cuts == [2000, 2000, 2000]
    verdict = verify(Path("run.h5"))
    assert verdict.holds
    assert (verdict.n_actions, verdict.n_states) == (4, 8)


@pytest.mark.parametrize(
    ("asked", "replayed", "states"),
    [(1, 1000, 2), (1000, 1000, 2), (1001, 2000, 3), (2001, 3000, 5), (10**9, RUN_STEPS, 7)],
)
def test_the_first_steps_can_be_replayed_alone(
    recorded: Path, asked: int, replayed: int, states: int
) -> None:
    verdict = verify(recorded, n_steps=asked)
    assert verdict.holds
    assert verdict.n_steps == replayed
    assert states <= verdict.n_states <= states + 1  # a cut at the end begins a world, too
    assert f"{replayed:,} of 4,500 steps" in verdict.lines()[-1]


def is_found_out(path: Path, **options: Any) -> bool:
    """Whether it is refused, or replayed and found to differ."""
    try:
        return not verify(path, **options).holds
    except RealBenchError:
        return True


def by(amount: float) -> Callable[[Any], Any]:
    return lambda value: value + amount


def ulp(value: Any) -> Any:
    return np.nextafter(value, 9)


CHANGES: list[tuple[str, str | None, int, Any]] = [
    ("commands", "command_0", 1, by(0.01)),
    ("commands", "command_1", 3, by(1e-9)),
    ("commands", "command_3", 2, ulp),
    ("commands", "n_steps", 0, by(1)),
    ("commands", "line", 0, by(1)),
    ("commands", "line", 2, by(2)),
    ("states", "joint_positions_0", 0, ulp),
    ("states", "joint_positions_3", 2, ulp),
    ("states", "joint_positions_8", 6, ulp),
    ("states", "touch_sensors_0", 1, ulp),
    ("states", "touch_sensors_3", 4, lambda value: value * np.nan),
    ("states", "step", 5, by(1)),
    ("ground_truth/object_poses", "cube_x", 0, ulp),
    ("ground_truth/object_poses", "tomato_z", 3, ulp),
    ("ground_truth/object_poses", "cube_qw", 6, ulp),
    ("ground_truth/object_poses", "tomato_qx", 5, lambda value: value * np.nan),
    ("images", None, 4, by(1)),
    ("cuts", "step", 0, by(1)),
    *(("transitions", name, 2, by(1)) for name in ("precondition", "outcome", "n_commands")),
    *(("transitions", name, 2, by(-1)) for name in ("first_command", "first_step", "n_steps")),
]


@pytest.mark.parametrize(("dataset", "field", "row", "change"), CHANGES)
def test_every_alteration_is_found(
    recorded: Path, tmp_path: Path, dataset: str, field: str | None, row: int, change: Any
) -> None:
    path = tmp_path / "run.h5"
    shutil.copy(recorded, path)
    with h5py.File(path, "r+") as file:
        rows = file[dataset][()]
        place = rows[field] if field else rows
        place[row] = change(place[row])
        file[dataset][...] = rows
    assert is_found_out(path, images=True)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("n_steps", RUN_STEPS - 1),
        ("total_steps", RUN_STEPS - 1),
        ("total_steps", RUN_STEPS + 1),  # and yet it says that it has ended
        ("objects", 1),
        ("object_names", '["cube", "mustard"]'),
        ("condition", "OJ"),
        ("scene", "official"),
        ("scene_sha256", "0" * 64),
        ("scene_source", "no/such.yaml"),
        ("images", False),
    ],
)
def test_altered_header_is_found(recorded: Path, tmp_path: Path, name: str, value: Any) -> None:
    path = tmp_path / "run.h5"
    shutil.copy(recorded, path)
    with h5py.File(path, "r+") as file:
        assert file.attrs[name] != value
        file.attrs[name] = value
    assert is_found_out(path)


def test_command_changed_without_effect_is_found_by_the_hash(
    builtin_scene: Scene, tmp_path: Path
) -> None:
    path = play(builtin_scene, tmp_path / "run.h5", 1300, condition="OJ")
    play(builtin_scene, path, 2300, condition="OJ")
    assert verify(path).notes == ()
    with h5py.File(path, "r+") as file:
        rows = file["commands"][()]
        joints = [f"command_{joint}" for joint in range(9)]
        assert rows[joints][-1].tolist() == (0.0,) * 9  # home
        rows["command_4"][-1] = 5e-324
        file["commands"][...] = rows
    verdict = verify(path)
    assert verdict.n_steps == 2300
    assert verdict.lines()[-1] == (
        "does not verify: it replays bit for bit, but its commands do not match their hash"
    )
    with h5py.File(path, "r+") as file:
        del file.attrs["commands_sha256"]  # as in a recording from before
    assert verify(path).holds
    assert "before commands were hashed" in verify(path).lines()[0]


def test_first_differing_action_is_reported_with_its_difference(
    recorded: Path, tmp_path: Path
) -> None:
    path = tmp_path / "run.h5"
    shutil.copy(recorded, path)
    with h5py.File(path, "r+") as file, edited_poses(file) as poses:
        poses[2, 1, 1] += 0.25
        poses[4:] += 1.0
    verdict = verify(path)
    assert verdict.lines()[-1] == (
        "does not verify: action 1 (steps 1,000 to 2,000): position of tomato differs by 0.25 m"
    )
    assert (verdict.n_actions, verdict.n_steps, verdict.n_states) == (1, 1000, 2)
    assert verify(path, n_steps=1000).holds


def test_other_start_after_a_cut_is_reported(recorded: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    shutil.copy(recorded, path)
    with h5py.File(path, "r+") as file, edited_poses(file) as poses:
        poses[3, 0, 0] += 0.5
    told = verify(path).lines()[-1]
    assert f"the world that begins at step {CUT_AT:,}: position of cube differs by 0.5 m" in told


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"n_steps": 0}, "steps must be a whole number of at least 1, not 0"),
        ({"scene": "moon"}, "unknown scene"),
        ({"path": Path("none.h5")}, "recording not found: none.h5"),
        ({"path": Path(__file__)}, "cannot be read"),
    ],
)
def test_bad_arguments_are_refused(recorded: Path, options: dict[str, Any], complaint: str) -> None:
    with pytest.raises(RealBenchError, match=complaint):
        RecordingVerification(**{"path": recorded, **options}).verify(ignore_two)


def test_recording_of_an_earlier_control_version_is_refused(recorded: Path, tmp_path: Path) -> None:
    path = tmp_path / "old.h5"
    shutil.copy(recorded, path)
    with h5py.File(path, "r+") as file:
        del file.attrs["control_version"]  # as before it was kept
    with pytest.raises(
        RecordingError, match="its macro-actions have version 1, this realbench has 2"
    ):
        verify(path)


def test_verification_can_be_stopped(recorded: Path) -> None:
    def press_ctrl_c(done: int, total: int) -> None:
        if done == 2000:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Interrupted, match="stopped after 2,000 of 4,500 steps"):
        RecordingVerification(recorded).verify(press_ctrl_c)


def test_comparing_images_needs_recorded_images(builtin_scene: Scene, tmp_path: Path) -> None:
    path = play(builtin_scene, tmp_path / "run.h5", 1000)
    with pytest.raises(RecordingError, match="without images"):
        verify(path, images=True)


def test_another_scene_is_a_fault(recorded: Path, official_scene: Scene) -> None:
    verdict = verify(recorded, scene=official_scene.source)
    assert not verdict.holds
    assert "it was made in another scene than official" in verdict.lines()[-1]
    assert verdict.n_steps == 0
