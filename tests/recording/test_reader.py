from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from real_bench.conditions import Condition
from real_bench.errors import RecordingError
from real_bench.files.kinds import RUN_FORMAT
from real_bench.recording import Experience, Recording
from real_bench.recording.schema import SCHEMA_VERSION


def refusal(path: Path) -> str:
    """The one line with which a file is refused."""
    with pytest.raises(RecordingError) as caught:
        Recording(path)
    message = str(caught.value)
    assert str(path) in message
    assert "\n" not in message
    return message


def test_a_truncated_file_is_refused_at_every_length(cut_path: Path, tmp_path: Path) -> None:
    content, damaged = cut_path.read_bytes(), tmp_path / "run.h5"
    lengths = {*range(0, len(content), len(content) // 150), *range(100), len(content) - 1}
    for length in lengths:
        damaged.write_bytes(content[:length])
        assert "damaged" in refusal(damaged)


def nothing(path: Path) -> None:
    pass


def text(path: Path) -> None:
    path.write_text("x, y, z\n" * 50)


def numpy_array(path: Path) -> None:
    with path.open("wb") as file:
        np.save(file, np.zeros((100, 7)))


def other_hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["transitions"] = np.zeros(3)


def only_the_name(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.attrs.update({"format": RUN_FORMAT, "schema_version": SCHEMA_VERSION})


@pytest.mark.parametrize(
    "make",
    [text, numpy_array, other_hdf5, only_the_name, Path.touch, Path.mkdir, lambda path: None],
)
def test_files_that_are_no_recording_are_refused(
    make: Callable[[Path], Any], tmp_path: Path
) -> None:
    path = tmp_path / "run.h5"
    make(path)
    refusal(path)


def test_a_newer_schema_is_refused_with_a_remedy(cut_path: Path, tmp_path: Path) -> None:
    assert "install a newer" in refusal(altered(cut_path, tmp_path, set_version))


def altered(source: Path, folder: Path, alter: Callable[[h5py.File], object]) -> Path:
    path = Path(shutil.copy(source, folder / "altered.h5"))
    with h5py.File(path, "r+") as file:
        alter(file)
    return path


def set_version(file: h5py.File) -> None:
    file.attrs["schema_version"] = SCHEMA_VERSION + 1


def lose_a_state(file: h5py.File) -> None:
    file["states"].resize(len(file["states"]) - 1, axis=0)


def lose_an_image(file: h5py.File) -> None:
    file["images"].resize(len(file["images"]) - 1, axis=0)


def lose_a_command(file: h5py.File) -> None:
    file["commands"].resize(len(file["commands"]) - 1, axis=0)


def lose_a_triplet(file: h5py.File) -> None:
    file["transitions"].resize(len(file["transitions"]) - 1, axis=0)


def lose_the_poses(file: h5py.File) -> None:
    del file["ground_truth"]


def count_a_step_more(file: h5py.File) -> None:
    file.attrs["n_steps"] += 1


def point_nowhere(file: h5py.File) -> None:
    rows = file["transitions"][()]
    rows["outcome"][-1] += 1
    file["transitions"][:] = rows


def swap_the_commands(file: h5py.File) -> None:
    rows = file["transitions"][()]
    rows["first_command"] = rows["first_command"][::-1]
    file["transitions"][:] = rows


def begin_before_the_play(file: h5py.File) -> None:
    rows = file["transitions"][()]
    rows["first_step"] -= 1
    file["transitions"][:] = rows


def begin_in_another_state(file: h5py.File) -> None:
    rows = file["transitions"][()]
    rows["precondition"][0] += 1
    file["transitions"][:] = rows


def end_beyond_the_last_state(file: h5py.File) -> None:
    rows = file["transitions"][()]
    rows["precondition"][-1] += 1
    rows["outcome"][-1] += 1
    file["transitions"][:] = rows


def do_nothing_in_an_action(file: h5py.File) -> None:
    rows = file["transitions"][()]
    rows["n_commands"][0] += rows["n_commands"][1]
    rows["n_commands"][1] = 0
    rows["first_command"] = np.cumsum(rows["n_commands"]) - rows["n_commands"]
    file["transitions"][:] = rows


def forget_the_seed(file: h5py.File) -> None:
    del file.attrs["seed"]


def garble_the_versions(file: h5py.File) -> None:
    file.attrs["versions"] = "{"


def use_an_unknown_condition(file: h5py.File) -> None:
    file.attrs["condition"] = "XY"


@pytest.mark.parametrize(
    "alter",
    [
        lose_a_state,
        lose_an_image,
        lose_a_command,
        lose_a_triplet,
        lose_the_poses,
        count_a_step_more,
        point_nowhere,
        swap_the_commands,
        begin_before_the_play,
        begin_in_another_state,
        end_beyond_the_last_state,
        do_nothing_in_an_action,
        forget_the_seed,
        garble_the_versions,
    ],
)
def test_inconsistent_rows_are_refused(
    alter: Callable[[h5py.File], None], cut_path: Path, tmp_path: Path
) -> None:
    refusal(altered(cut_path, tmp_path, alter))


def test_unknown_condition_is_refused_naming_the_file(cut_path: Path, tmp_path: Path) -> None:
    refusal(altered(cut_path, tmp_path, use_an_unknown_condition))


@pytest.mark.parametrize("attribute", ["format", "schema_version"])
def test_attributes_of_a_wrong_type_are_refused(
    attribute: str, cut_path: Path, tmp_path: Path
) -> None:
    def alter(file: h5py.File) -> None:
        file.attrs[attribute] = np.array([1, 2])

    refusal(altered(cut_path, tmp_path, alter))


def test_damaged_image_is_reported_with_its_file(cut_path: Path, tmp_path: Path) -> None:
    path = Path(shutil.copy(cut_path, tmp_path / "altered.h5"))
    with h5py.File(path) as file:
        chunk = file["images"].id.get_chunk_info(0)
    with path.open("r+b") as raw:
        raw.seek(chunk.byte_offset)
        raw.write(b"\xff" * 64)
    with pytest.raises(RecordingError, match=str(path)):
        Experience(path, Condition.parse("OM")).image_before(0)


CLOSED: list[Callable[[Recording], object]] = [
    lambda run: run.has_poses,
    lambda run: run.object_poses,
    lambda run: run.displacements(),
    lambda run: run.logged,
    lambda run: run.images(),
    lambda run: run.image_shape,
    lambda run: run.states,
    lambda run: run.commands(),
    lambda run: run.parts,
    lambda run: run.controller_state(),
    lambda run: run[0],
]


@pytest.mark.parametrize("ask", CLOSED)
def test_a_closed_recording_says_that_it_is_closed(
    ask: Callable[[Recording], object], cut_path: Path
) -> None:
    with Recording(cut_path) as recording:
        pass
    with pytest.raises(RecordingError, match="is closed"):
        ask(recording)
