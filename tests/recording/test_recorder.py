from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from real_bench.conditions import Condition
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.recording import Experience, Recording, recorder
from real_bench.recording.schema import chained_sha256
from real_bench.simulation import Scene
from real_bench.task import Task
from tests.recording.bench import ignore
from tests.recording.conftest import CUT_AT, CUT_RUN_STEPS


def test_steps_and_commands_are_counted_without_gaps(cut_run: Recording) -> None:
    rows = cut_run.transitions
    durations, counts = rows["n_steps"], rows["n_commands"]
    assert rows["first_step"].tolist() == [0, *np.cumsum(durations)[:-1]]
    assert rows["first_command"].tolist() == [0, *np.cumsum(counts)[:-1]]
    assert cut_run.n_steps == cut_run.total_steps == CUT_RUN_STEPS == durations.sum()
    assert durations.tolist() == [1000, 1000, 1000, 500, 1000, 1000, 700]
    steps = cut_run.states["step"]
    assert (steps[rows["precondition"]] == rows["first_step"]).all()
    assert (steps[rows["outcome"]] == rows["first_step"] + durations).all()


def test_outcome_is_the_next_precondition_except_at_a_cut(cut_run: Recording) -> None:
    rows = cut_run.transitions
    continues = rows["outcome"][:-1] == rows["precondition"][1:]
    assert cut_run.cuts == [CUT_AT]
    assert (continues == (rows["first_step"][1:] != CUT_AT)).all()
    assert (rows["outcome"] == rows["precondition"] + 1).all()


def test_world_resumes_where_it_was_cut(cut_run: Recording) -> None:
    rows = cut_run.transitions
    first = int(np.flatnonzero(rows["first_step"] == CUT_AT)[0])
    before, after = rows["outcome"][first - 1], rows["precondition"][first]
    poses, joints = cut_run.object_poses, cut_run.states["joint_positions"]
    np.testing.assert_allclose(poses[after], poses[before], atol=1e-12)
    np.testing.assert_allclose(joints[after], joints[before], atol=1e-12)


def test_replaying_the_actions_reproduces_the_recording(
    cut_path: Path, cut_run: Recording, scene: Scene
) -> None:
    """Poses, joints, touch and images, to the last bit."""
    experience, rows = Experience(cut_path, Condition.parse("OM")), cut_run.transitions
    states, poses, images = cut_run.states, cut_run.object_poses, cut_run.images()
    task = Task(scene, Condition.parse("OM"), 2)

    def check(row: int) -> None:
        seen = task.observe()
        np.testing.assert_array_equal(seen["retina"], images[row])
        np.testing.assert_array_equal(task.simulation.object_poses(), poses[row])
        for key in ("joint_positions", "touch_sensors"):
            np.testing.assert_array_equal(seen[key], states[key][row])

    for i, (before, after) in enumerate(zip(rows["precondition"], rows["outcome"], strict=True)):
        if rows["first_step"][i] in (0, *cut_run.cuts):
            joints = states["joint_positions"][before - 1] if i else None
            task.begin(object_poses=poses[before - 1] if i else None, joint_positions=joints)
        check(before)
        task.execute(experience.action(i))
        check(after)
    task.close()


def test_hash_of_commands_does_not_depend_on_write_times(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hashes = []
    for seconds in (0.0, 60.0):
        monkeypatch.setattr(recorder, "SECONDS_BETWEEN_WRITES", seconds)
        out = tmp_path / f"{seconds}.h5"
        for steps in (2000, 4000):
            IntrinsicPhase("real_r", Condition.parse("OM"), 1, scene, steps, 0, out).run(
                ignore, resume=True
            )
        with Recording(out) as recording:
            hashes.append(recording.commands_sha256)
            counts, commands = recording.transitions["n_commands"], recording.commands()
            assert chained_sha256("", counts, commands) == recording.commands_sha256
    assert hashes[0] == hashes[1] != ""


def test_recording_without_a_hash_is_resumed_without_one(scene: Scene, tmp_path: Path) -> None:
    out = tmp_path / "run.h5"
    phases = [
        IntrinsicPhase("real_r", Condition.parse("OM"), 1, scene, steps, 0, out)
        for steps in (1000, 2000)
    ]
    phases[0].run(ignore)
    with h5py.File(out, "r+") as file:
        del file.attrs["commands_sha256"]
    phases[1].run(ignore, resume=True)
    with Recording(out) as recording:
        assert recording.n_steps == 2000
        assert recording.commands_sha256 is None


def test_moved_objects_show_in_poses_and_images(cut_run: Recording) -> None:
    rows, images = cut_run.transitions, cut_run.images()
    poses = cut_run.object_poses[:, :, :3]
    far = np.linalg.norm(poses[rows["outcome"]] - poses[rows["precondition"]], axis=2)
    np.testing.assert_allclose(cut_run.displacements(), far)
    assert cut_run.share_moved() == pytest.approx((far.max(axis=1) > 0.01).mean())
    assert far.max() > 0.01
    assert any((images[k] != images[k + 1]).any() for k in range(len(images) - 1))


def test_three_hundred_images_take_less_than_a_megabyte(image_path: Path) -> None:
    with h5py.File(image_path) as file:  # the file's own size depends on how often it was written
        images = file["images"]
        assert len(images) == 21
        assert images.id.get_storage_size() / len(images) * 300 < 1e6


def test_nothing_lies_beside_a_finished_recording(cut_path: Path, image_path: Path) -> None:
    for path in (cut_path, image_path):
        assert list(path.parent.iterdir()) == [path]
