"""`realbench export`: what others read is what was recorded."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from real_bench.exporting import FORMATS, Export
from real_bench.exporting.minari import MIN_VERSION
from real_bench.extras import MissingExtraError, extra
from real_bench.recording import Recording
from real_bench.recording.columns import flat
from tests.cli.shell import realbench
from tests.phases.conftest import toy
from tests.recording.test_tables import VERSION_1

LOGS = toy("logs:Logs")
PLAY = ("intrinsic", "--scene", "builtin", "--resume")
TABLES = ("transitions", "commands", "states", "object_poses", "logged")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One object with images, cut once; joints, whose actions have many commands; an old one."""
    folder = tmp_path_factory.mktemp("export")
    for steps in ("2000", "5000"):
        realbench(folder, *PLAY, "--controller", LOGS, "--images", "--steps", steps,
                  "--condition", "OM", "--out", "my run.h5")  # fmt: skip
    realbench(folder, *PLAY, "--controller", "real_r", "--condition", "IJ", "--steps", "2300",
              "--out", "joints.h5")  # fmt: skip
    shutil.copy(VERSION_1, folder / "old.h5")
    return folder


def expected(path: Path) -> dict[str, Any]:
    """The tables by name, with columns of numbers."""
    with Recording(path) as recording:
        poses = recording.object_poses
        return {
            "transitions": recording.transitions,
            "commands": recording.commands().view(flat(recording.commands().dtype)),
            "states": recording.states.view(flat(recording.states.dtype)),
            "object_poses": poses.reshape(len(poses), -1),
            "logged": recording.logged,
        }


@pytest.mark.parametrize("name", ["my run", "joints", "old"])
def test_csv_has_every_number_to_the_last_digit(place: Path, name: str, tmp_path: Path) -> None:
    realbench(place, "export", f"{name}.h5", "--out", tmp_path)
    for table, rows in expected(place / f"{name}.h5").items():
        with (tmp_path / f"{table}.csv").open(newline="", encoding="utf-8") as file:
            head, *lines = list(csv.reader(file))
        assert len(lines) == len(rows)
        if table == "object_poses":
            assert head[:3] == ["cube_x", "cube_y", "cube_z"]
            np.testing.assert_array_equal(np.array(lines, float), rows)
            continue
        assert tuple(head) == rows.dtype.names
        for column, cells in zip(head, zip(*lines, strict=True), strict=False):
            if column == "name":
                assert list(cells) == rows[column].tolist()
            else:
                np.testing.assert_array_equal(np.array(cells, float), rows[column])
    facts = json.loads((tmp_path / "recording.json").read_text())
    assert facts["scene"] == "builtin"


@pytest.mark.parametrize("name", ["my run", "joints", "old"])
def test_pandas_reads_the_same_table_from_parquet(place: Path, name: str, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    realbench(place, "export", f"{name}.h5", "--to", "parquet", "--out", tmp_path)
    for table, rows in expected(place / f"{name}.h5").items():
        read = pandas.read_parquet(tmp_path / f"{table}.parquet")
        if table == "object_poses":
            np.testing.assert_array_equal(read.to_numpy(), rows)
            continue
        assert tuple(read.columns) == rows.dtype.names
        for column in read.columns:
            if column == "name":
                assert read[column].tolist() == rows[column].tolist()
            else:
                np.testing.assert_array_equal(read[column].to_numpy(), rows[column])
                assert read[column].dtype == rows[column].dtype


def load(folder: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(folder))
    return pytest.importorskip("minari").load_dataset(name)


@pytest.fixture
def with_minari() -> None:
    """Skips where Minari cannot be had: it needs Python 3.11."""
    pytest.importorskip("minari", minversion=MIN_VERSION)


@pytest.mark.usefixtures("with_minari")
def test_minari_reads_the_exported_dataset(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = realbench(place, "export", "my run.h5", "--to", "minari", "--out", tmp_path)
    assert "minari.load_dataset('realbench/my-run-v0')" in done.stdout
    dataset = load(tmp_path, "realbench/my-run-v0", monkeypatch)
    assert (dataset.total_episodes, dataset.total_steps) == (2, 5)
    with Recording(place / "my run.h5") as recording:
        triplets = list(recording)
    episodes = list(dataset.iterate_episodes())
    assert [len(episode) for episode in episodes] == [2, 3]
    done_so_far = 0
    for episode in episodes:
        for number in range(len(episode)):
            triplet = triplets[done_so_far + number]
            for state, row in ((triplet.before, number), (triplet.after, number + 1)):
                seen = {key: values[row] for key, values in episode.observations.items()}
                assert dataset.observation_space.contains(seen)
                np.testing.assert_array_equal(seen["retina"], state.image)
                np.testing.assert_array_equal(seen["joint_positions"], state.joint_positions)
                np.testing.assert_array_equal(seen["touch_sensors"], state.touch_sensors)
                assert state.object_poses is not None
                poses = state.object_poses
                np.testing.assert_array_equal(seen["object_positions"], poses[:, :3].ravel())
                np.testing.assert_array_equal(seen["object_orientations"], poses[:, 3:].ravel())
                assert episode.infos["step"][row] == state.step
            assert dataset.action_space.contains(episode.actions[number])
            np.testing.assert_array_equal(episode.actions[number], triplet.action.commands[0])
        assert episode.truncations.tolist() == [False] * (len(episode) - 1) + [True]
        assert not episode.terminations.any()
        assert not episode.rewards.any()
        done_so_far += len(episode)


@pytest.mark.usefixtures("with_minari")
def test_minari_export_of_joint_actions_and_resized_images(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    realbench(place, "export", "joints.h5", "--to", "minari", "--image-size", "40x30",
              "--name", "joints-v3", "--out", tmp_path)  # fmt: skip
    dataset = load(tmp_path, "joints-v3", monkeypatch)
    (episode,) = dataset.iterate_episodes()
    with Recording(place / "joints.h5") as recording:
        arrays = recording.to_numpy(image_size=(40, 30))
    assert set(episode.observations) == {"joint_positions", "touch_sensors", "retina"}
    np.testing.assert_array_equal(episode.observations["retina"][1:], arrays["image_after"])
    np.testing.assert_array_equal(episode.observations["retina"][:-1], arrays["image_before"])
    for key in ("commands", "n_steps", "line"):
        np.testing.assert_array_equal(episode.actions[key], arrays[key])
    assert episode.actions["n_steps"].sum(axis=1).tolist() == [1000, 1000, 300]


@pytest.mark.usefixtures("with_minari")
def test_episode_written_in_pieces_equals_one_written_whole(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from real_bench.exporting import minari

    datasets = []
    for name, at_once in (("whole-v0", 100), ("pieces-v0", 2)):
        monkeypatch.setattr(minari, "ACTIONS_AT_ONCE", at_once)
        with Recording(place / "my run.h5") as recording:
            FORMATS["minari"](Export(recording, tmp_path, name=name), lambda *_: None)
        datasets.append(load(tmp_path, name, monkeypatch))
    whole, pieces = datasets
    assert whole.total_steps == pieces.total_steps == 5
    for one, other in zip(whole.iterate_episodes(), pieces.iterate_episodes(), strict=True):
        assert len(one) == len(other)
        np.testing.assert_equal(one.observations, other.observations)
        np.testing.assert_equal(one.actions, other.actions)
        np.testing.assert_equal(one.truncations, other.truncations)
        np.testing.assert_equal(one.infos, other.infos)


@pytest.mark.usefixtures("with_minari")
def test_export_is_overwritten_only_on_request(place: Path, tmp_path: Path) -> None:
    for form in ("csv", "minari"):
        realbench(place, "export", "my run.h5", "--to", form, "--out", tmp_path)
        again = realbench(place, "export", "my run.h5", "--to", form, "--out", tmp_path, code=1)
        assert "exists: use --overwrite" in again.stderr
        realbench(place, "export", "my run.h5", "--to", form, "--out", tmp_path, "--overwrite")
    other = tmp_path / "mine-v0"
    other.mkdir()
    (other / "thesis.tex").write_text("years of work")
    told = realbench(place, "export", "my run.h5", "--to", "minari", "--out", tmp_path,
                     "--name", "mine-v0", "--overwrite", code=1)  # fmt: skip
    assert "is not a Minari dataset, so it is not replaced" in told.stderr
    assert (other / "thesis.tex").read_text() == "years of work"


def content(folder: Path) -> dict[str, bytes]:
    """Every file below a folder."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


class StopError(Exception):
    """Somebody stops it."""


@pytest.mark.parametrize("form", ["csv", "minari"])
def test_export_that_fails_leaves_the_old_one(place: Path, tmp_path: Path, form: str) -> None:
    """All of it, and nothing beside it."""
    if form == "minari":
        pytest.importorskip("minari", minversion=MIN_VERSION)
    named = ("--name", "old-v0") if form == "minari" else ()
    realbench(place, "export", "joints.h5", "--to", form, *named, "--out", tmp_path)
    before = content(tmp_path)

    def stop(done: int, total: int) -> None:
        if done > total / 2:
            raise StopError

    with Recording(place / "my run.h5") as recording, pytest.raises(StopError):
        FORMATS[form](Export(recording, tmp_path, name="old-v0", overwrite=True), stop)
    assert content(tmp_path) == before


def test_positions_of_another_recording_do_not_stay(place: Path, tmp_path: Path) -> None:
    shutil.copy(place / "joints.h5", tmp_path / "excerpt.h5")
    with h5py.File(tmp_path / "excerpt.h5", "r+") as file:
        del file["ground_truth"]
        file.attrs["excerpt"] = True
    out = ("--out", tmp_path / "tables")
    realbench(place, "export", "my run.h5", *out)
    realbench(tmp_path, "export", "excerpt.h5", *out, "--overwrite")
    assert set(content(tmp_path / "tables")) == {
        *(f"{table}.csv" for table in TABLES if table != "object_poses"),
        "recording.json",
    }


@pytest.mark.usefixtures("with_minari")
def test_export_that_is_refused_leaves_the_old_one(place: Path, tmp_path: Path) -> None:
    options = ("joints.h5", "--to", "minari", "--out", tmp_path)
    realbench(place, "export", *options)
    before = content(tmp_path)
    small = ("--image-size", "80x60", "--overwrite")
    (place / "bare").mkdir()
    realbench(place, "intrinsic", "--scene", "builtin", "--controller", "real_r", "--condition",
              "OM", "--steps", "1000", "--out", "bare/joints.h5")  # fmt: skip
    refused = realbench(place, "export", "bare/joints.h5", *options[1:], *small, code=1).stderr
    assert "has no images to shrink" in refused
    assert content(tmp_path) == before
    asked = ("bare/joints.h5", *options[1:], "--images", "--overwrite")
    refused = realbench(place, "export", *asked, code=1).stderr
    assert "bare/joints.h5 has no images: leave out --images" in refused
    assert content(tmp_path) == before
    nested = ("--name", "realbench/joints-v0/other-v0")
    realbench(place, "export", *options, *nested)
    refused = realbench(place, "export", *options, "--overwrite", code=1).stderr
    assert "is not replaced, since there is something else in it (other-v0)" in refused


@pytest.mark.parametrize(
    ("arguments", "code", "complaint"),
    [
        (("none.h5",), 1, "recording not found: none.h5"),
        (("my run.h5", "--to", "lerobot"), 2, "'lerobot' is not one of"),
        (
            ("my run.h5", "--image-size", "80x60"),
            2,
            "--images, --image-size and --name need --to minari",
        ),
        (("my run.h5", "--to", "minari", "--image-size", "80"), 2, "like 80x60"),
        (("my run.h5", "--to", "minari", "--image-size", "0x9"), 2, "must be 1 to 4096"),
        (("my run.h5", "--to", "minari", "--name", "../x"), 1, "a dataset's name must look like"),
        (("my run.h5", "--out", "my run.h5"), 1, "cannot write into my run.h5"),
        (
            ("my run.h5", "--to", "minari", "--no-images", "--image-size", "80x60"),
            2,
            "--image-size needs images: leave out --no-images",
        ),
    ],
)
def test_bad_export_arguments_give_a_one_line_error(
    place: Path, arguments: tuple[str, ...], code: int, complaint: str
) -> None:
    done = realbench(place, "export", *arguments, code=code)
    assert complaint in done.stderr
    assert done.stderr.count("\n") == 1


def test_missing_library_is_named(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("minari", "pyarrow", "tensorboard"):
        (tmp_path / f"{module}.py").write_text("raise ImportError('not here')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    for command, name in (
        (("export", "my run.h5", "--to", "minari", "--out", tmp_path / "a"), "minari"),
        (("export", "my run.h5", "--to", "parquet", "--out", tmp_path / "b"), "parquet"),
        (("watch", "my run.h5", "--tensorboard", tmp_path / "c"), "tensorboard"),
    ):
        told = realbench(place, *command, code=1).stderr
        assert f"pip install 'real-bench[{name}]'" in told

        assert told.count("\n") == 1
    assert not [path for path in tmp_path.iterdir() if path.is_dir() and path.name in "abc"]


def test_outdated_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("real_bench.extras.version", lambda _: "0.5.3")
    with pytest.raises(MissingExtraError, match=r"needs json 0\.5\.4, and 0\.5\.3 is installed"):
        extra("json.decoder", "minari", MIN_VERSION)
    assert extra("json.decoder", "minari", "0.5.3").__name__ == "json.decoder"
