"""What a recording gives to whoever trains on it."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from real_bench.conditions import Condition
from real_bench.errors import RecordingError
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.recording import Experience, Recording
from real_bench.simulation import Scene
from tests.recording.bench import ignore


def test_triplets_match_the_tables(cut_path: Path, cut_run: Recording) -> None:
    experience = Experience(cut_path, "OM")
    assert len(cut_run) == len(experience) == 7
    for number, triplet in enumerate(cut_run):
        row = cut_run.transitions[number]
        assert triplet.before.step == row["first_step"]
        assert triplet.after.step == row["first_step"] + row["n_steps"]
        assert triplet.action.duration == row["n_steps"]
        np.testing.assert_array_equal(triplet.action.commands, experience.action(number).commands)
        assert triplet.before.object_poses is not None
        np.testing.assert_array_equal(
            triplet.before.object_poses[:, :3], experience.positions_before()[number]
        )
        np.testing.assert_array_equal(triplet.before.image, experience.image_before(number))
        np.testing.assert_array_equal(triplet.after.image, experience.image_after(number))
    np.testing.assert_array_equal(cut_run[-1].after.image, cut_run[6].after.image)
    for beyond in (7, -8, True, [True, False]):
        with pytest.raises(IndexError):
            cut_run[beyond]
    for size in (64, (64,), (0, 3), (6.5, 3), "ab"):
        with pytest.raises(RecordingError, match="an image size is"):
            cut_run.to_numpy(image_size=size)  # type: ignore[arg-type]


def test_images_are_the_same_in_every_slice(image_path: Path) -> None:
    with Recording(image_path) as recording:
        all_of_them = recording.images()
        assert len(all_of_them) == 21
        for first, count in ((0, 21), (3, 16), (15, 2), (16, 5), (20, 1), (20, 9), (21, 1)):
            part = recording.images(first, count)
            np.testing.assert_array_equal(part, all_of_them[first : first + count])


def test_arrays_have_one_row_per_triplet(cut_run: Recording) -> None:
    arrays = cut_run.to_numpy(image_size=(40, 30))
    assert {len(values) for values in arrays.values()} == {7}
    assert arrays["image_after"].shape == (7, 30, 40, 3)
    assert cut_run.to_numpy(images=True)["image_before"].shape == (7, 240, 320, 3)
    assert "image_before" not in cut_run.to_numpy()
    for number, triplet in enumerate(cut_run):
        np.testing.assert_array_equal(
            arrays["object_poses_after"][number], triplet.after.object_poses
        )
        k = len(triplet.action.commands)
        np.testing.assert_array_equal(arrays["commands"][number, :k], triplet.action.commands)
        assert arrays["n_steps"][number, :k].tolist() == triplet.action.n_steps.tolist()
        assert not arrays["n_steps"][number, k:].any()


def test_actions_of_many_commands_are_padded(scene: Scene, tmp_path: Path) -> None:
    out = tmp_path / "run.h5"
    IntrinsicPhase("real_r", Condition.parse("OJ"), 1, scene, 1300, seed=0, out=out).run(ignore)
    with Recording(out) as recording:
        arrays = recording.to_numpy()
        whole, cut = recording[0].action, recording[1].action
    assert arrays["commands"].shape == (2, len(whole.commands), 9)
    assert arrays["n_steps"].sum(axis=1).tolist() == [1000, 300]
    assert len(cut.commands) < len(whole.commands)
    assert arrays["line"][0].tolist() == whole.line.tolist()


@pytest.mark.parametrize("image_size", [None, (40, 30)])
@pytest.mark.parametrize("cached", [False, True])
def test_shuffled_loader_with_workers_gives_every_triplet_once(
    cut_run: Recording, tmp_path: Path, image_size: tuple[int, int] | None, cached: bool
) -> None:
    from torch.utils.data import DataLoader

    arrays = cut_run.to_numpy(images=image_size is None, image_size=image_size)
    cache = tmp_path / "cache" if cached else None
    for _ in range(2):  # the second time from the cache
        dataset = cut_run.torch_dataset(image_size=image_size, cache=cache)
        loader = DataLoader(dataset, batch_size=3, shuffle=True, num_workers=2)
        batches = list(loader)
        assert sum(len(batch["n_steps"]) for batch in batches) == len(cut_run)
        seen = np.concatenate([batch["object_poses_before"].numpy() for batch in batches])
        order = [
            int(np.flatnonzero((arrays["object_poses_before"].astype("f4") == one).all((1, 2)))[0])
            for one in seen
        ]
        images = np.concatenate([batch["image_after"].numpy() for batch in batches])
        expected = arrays["image_after"][order].transpose(0, 3, 1, 2)
        assert [one.tobytes() for one in images] == [one.tobytes() for one in expected]
    assert (cache is None) or len(list(tmp_path.glob("cache/images-*.npy"))) == 1


def test_cache_of_another_recording_is_not_used(
    cut_run: Recording, image_path: Path, tmp_path: Path
) -> None:
    with Recording(image_path) as other:
        for recording in (cut_run, other, cut_run):
            recording.torch_dataset(image_size=(8, 6), cache=tmp_path)
        recording.torch_dataset(image_size=(16, 12), cache=tmp_path)
        assert len(list(tmp_path.iterdir())) == 3
        first = other.torch_dataset(image_size=(8, 6), cache=tmp_path)[0]
        expected = other.to_numpy(image_size=(8, 6))["image_before"][0].transpose(2, 0, 1)
        np.testing.assert_array_equal(first["image_before"].numpy(), expected)


def test_dataset_outlives_its_recording_and_can_be_pickled(cut_path: Path) -> None:
    with Recording(cut_path) as recording:
        dataset = recording.torch_dataset()
        expected = recording[3].after.image
    dataset[0]
    again = pickle.loads(pickle.dumps(dataset))
    assert expected is not None
    np.testing.assert_array_equal(again[3]["image_after"].numpy(), expected.transpose(2, 0, 1))


def test_recording_without_images_gives_the_rest(scene: Scene, tmp_path: Path) -> None:
    out = tmp_path / "run.h5"
    IntrinsicPhase("real_r", Condition.parse("OM"), 1, scene, 1000, seed=0, out=out).run(ignore)
    with Recording(out) as recording:
        assert recording[0].before.image is None
        assert "image_before" not in recording.torch_dataset()[0]
        for ask in (recording.to_numpy, recording.torch_dataset):
            with pytest.raises(RecordingError, match="recorded without images"):
                ask(image_size=(8, 6))
