"""The tables of a recording, as others read them; recordings of the schema before."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from real_bench.conditions import Condition
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.recording import Experience, Recording
from real_bench.recording.excerpt import write_excerpt
from real_bench.simulation import Scene
from real_bench.verification import RecordingVerification
from tests.recording.bench import ignore

VERSION_1 = Path(__file__).parent / "files" / "version-1.h5"
"""Five actions with two objects and images, cut after three; written before schema version 2."""

READ_PLAINLY = """
import sys
import h5py, pandas
names = "transitions", "commands", "states", "ground_truth/object_poses", "cuts", "logged"
with h5py.File("run.h5") as file:
    for name in names:
        table = pandas.DataFrame(file[name][()])
        print(name, len(table), *table.columns)
    assert "hdf5plugin" not in sys.modules
    try:
        file["images"][0]
    except OSError as error:
        print("images:", error)
"""


def test_plain_h5py_and_pandas_read_the_tables_without_a_plugin(
    cut_path: Path, tmp_path: Path
) -> None:
    pytest.importorskip("pandas")
    shutil.copy(cut_path, tmp_path / "run.h5")
    done = subprocess.run(
        [sys.executable, "-c", READ_PLAINLY],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env={"HDF5_PLUGIN_PATH": str(tmp_path)},
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].startswith("transitions 7 precondition outcome first_command")
    assert lines[1] == "commands 7 command_0 command_1 command_2 command_3 n_steps line"
    assert lines[2].endswith(
        "joint_positions_8 touch_sensors_0 touch_sensors_1 touch_sensors_2 touch_sensors_3 step"
    )
    assert lines[3].startswith("ground_truth/object_poses 9 cube_x cube_y cube_z cube_qx")
    assert lines[4] == "cuts 1 step controller_sha256 versions"
    assert lines[5] == "logged 0 step action name value"
    assert lines[6].startswith("images:")


def test_columns_hold_the_same_numbers(cut_run: Recording) -> None:
    with h5py.File(cut_run.path) as file:
        states, poses = file["states"][()], file["ground_truth/object_poses"][()]
        commands = file["commands"][()]
    np.testing.assert_array_equal(
        cut_run.states["joint_positions"][:, 8], states["joint_positions_8"]
    )
    np.testing.assert_array_equal(cut_run.states["touch_sensors"][:, 1], states["touch_sensors_1"])
    np.testing.assert_array_equal(cut_run.object_poses[:, 1, 2], poses["tomato_z"])
    np.testing.assert_array_equal(cut_run.object_poses[:, 0, 6], poses["cube_qw"])
    np.testing.assert_array_equal(cut_run.commands()["command"][:, 3], commands["command_3"])


def test_a_recording_of_version_1_is_read_and_replayed() -> None:
    with Recording(VERSION_1) as recording:
        assert recording.file.attrs["schema_version"] == 1
        assert recording.object_poses.shape == (7, 2, 7)
        assert recording.states["joint_positions"].shape == (7, 9)
        assert recording.images().shape == (7, 240, 320, 3)
        assert len(recording.logged) == 0
        whole = recording[4]
    assert whole.after.image is not None
    verdict = RecordingVerification(VERSION_1).verify(lambda done, total: None)
    assert verdict.holds


def test_recording_of_version_1_is_resumed(builtin_scene: Scene, tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    shutil.copy(VERSION_1, path)
    with Recording(path) as recording:
        before = recording.states
    phase = IntrinsicPhase(
        "real_r", Condition.parse("OM"), 2, builtin_scene, 6000, seed=4, out=path, images=True
    )
    phase.run(ignore, resume=True)
    with Recording(path) as recording:
        assert recording.n_steps == 6000
        assert recording.file.attrs["schema_version"] == 1
        np.testing.assert_array_equal(recording.states[: len(before)], before)
    assert RecordingVerification(path, images=True).verify(lambda done, total: None).holds


@pytest.mark.parametrize("n_steps", [None, 2000])
def test_an_excerpt_of_either_version_is_read(
    cut_path: Path, tmp_path: Path, n_steps: int | None
) -> None:
    for number, path in enumerate((cut_path, VERSION_1)):
        experience = Experience(path, "OM", n_steps)
        excerpt = tmp_path / f"{number}-excerpt.h5"
        write_excerpt(experience, excerpt)
        again = Experience(excerpt, "OM")
        np.testing.assert_array_equal(again.positions_after(), experience.positions_after())
        np.testing.assert_array_equal(again.image_after(1), experience.image_after(1))
