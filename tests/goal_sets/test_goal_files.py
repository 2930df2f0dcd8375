import struct
import tempfile
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from real_bench.errors import GoalSetError
from real_bench.files.atomic import OutputError
from real_bench.goal_sets import load_goal_set, save_goal_set
from real_bench.goal_sets.png import decode_png, encode_png
from tests.goal_sets.goal_examples import goal_sets, make_goal_set


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "goals.npy"
    save_goal_set(make_goal_set(), path)
    return path


def changed(path, row=0, **fields):
    """The file with fields of one row replaced."""
    rows = np.load(path, allow_pickle=False)
    for field, value in fields.items():
        rows[field][row] = value
    np.save(path, rows)
    return path


def refusal(path):
    """The one line that says why a file cannot be loaded."""
    with pytest.raises(GoalSetError) as caught:
        load_goal_set(path)
    message = str(caught.value)
    assert "\n" not in message
    assert str(path) in message
    return message


@given(goal_sets)
@settings(deadline=None)
def test_saved_goal_set_is_loaded_unchanged(goal_set):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "goals.npy"
        save_goal_set(goal_set, path)
        loaded = load_goal_set(path)
    assert loaded.sha256 == goal_set.sha256
    for before, after in zip(goal_set.goals, loaded.goals, strict=True):
        for field in ("initial_poses", "final_poses", "retina_before", "retina", "mask"):
            np.testing.assert_array_equal(getattr(before, field), getattr(after, field))


def test_the_same_set_gives_the_same_bytes(tmp_path):
    first, second = tmp_path / "1.npy", tmp_path / "2.npy"
    save_goal_set(make_goal_set(), first)
    save_goal_set(load_goal_set(first), second)
    assert first.read_bytes() == second.read_bytes()


def test_numpy_alone_can_read_it(path):
    rows = np.load(path, allow_pickle=False)
    assert rows["challenge"].tolist() == [goal.challenge for goal in make_goal_set().goals]
    assert rows["initial_poses"].shape == (3, 2, 7)
    retina = decode_png(bytes(rows["retina_png"][1]))
    np.testing.assert_array_equal(retina, make_goal_set().goals[1].retina)


def test_rows_may_be_removed(path):
    np.save(path, np.load(path)[1:])
    assert [goal.sha256 for goal in load_goal_set(path).goals] == [
        goal.sha256 for goal in make_goal_set().goals[1:]
    ]


def test_failed_write_leaves_nothing(tmp_path):
    with pytest.raises(OutputError, match="cannot write"):
        save_goal_set(make_goal_set(), tmp_path / "missing" / "goals.npy")
    assert list(tmp_path.iterdir()) == []


def test_missing_file_is_reported(tmp_path):
    assert "No such file" in refusal(tmp_path / "missing.npy")


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"\x93NUMPY\x01\x00", b"hello" * 100])
def test_foreign_bytes_are_refused(path, content):
    path.write_bytes(content)
    assert "it is not a .npy file" in refusal(path)


def test_pickled_objects_are_refused(path):
    np.save(path, np.array([{"a": 1}], object), allow_pickle=True)
    assert "pickled Python objects" in refusal(path)


def test_error_for_official_files_names_the_importer(tmp_path):
    path = tmp_path / "official.npz"
    path.write_bytes(b"PK")
    assert "realbench goals import" in refusal(path)


@pytest.mark.parametrize("array", [np.zeros(3), np.zeros((2, 2)), np.array(1), np.zeros(0)])
def test_other_arrays_are_refused(path, array):
    np.save(path, array)
    refusal(path)


def test_a_giant_array_is_refused_before_it_is_read(path):
    header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }"
    text = header.ljust(117).encode() + b"\n"
    path.write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text)
    assert "it declares 8000000000000 bytes but holds 0" in refusal(path)


@pytest.mark.parametrize("shape", ["(-1,)", "(True,)", "(" * 2000, "-" * 5000 + "1", "('a',)"])
def test_a_malicious_header_is_refused(path, shape):
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}\n".encode()
    path.write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text)
    refusal(path)


def test_newer_version_is_refused(path):
    assert "it has version 7, this realbench reads 1" in refusal(changed(path, version=7))


def test_other_format_is_refused(path):
    assert "its format is not 'realbench-goals'" in refusal(
        changed(path, format="holiday-pictures")
    )


def test_missing_fields_are_named(path):
    rows = np.load(path)
    np.save(path, rows[["format", "challenge"]].copy())
    assert "no field 'version'" in refusal(path)
    np.save(path, rows[["format", "version"]].copy())
    assert "fields are not those of version 1" in refusal(path)


def test_goals_of_different_origin_are_refused(path):
    assert "goal 1 has another seed than goal 0" in refusal(changed(path, row=1, seed=8))


def test_altered_poses_are_detected(path):
    poses = np.load(path)["final_poses"][0]
    poses[0, 0] += 1e-9
    assert "goal 0 does not match its hash" in refusal(changed(path, final_poses=poses))


def test_an_image_bomb_is_refused_before_it_is_decoded(path):
    size = np.load(path).dtype["retina_png"].itemsize
    start = struct.pack(">II5B", 60_000, 60_000, 8, 2, 0, 0, 0)
    chunk = b"IHDR" + start
    bomb = b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + chunk
    bomb += struct.pack(">I", zlib.crc32(chunk))
    assert "declares 60000x60000" in refusal(
        changed(path, retina_png=np.void(bomb.ljust(size, b"\0")))
    )


def test_an_image_of_another_kind_is_refused(path):
    rows = np.load(path)
    grey = bytes(rows["mask_png"][0]).ljust(rows.dtype["retina_png"].itemsize, b"\0")
    assert "retina is uint8 of shape (6, 8)" in refusal(changed(path, retina_png=np.void(grey)))


def test_an_image_of_another_size_is_refused(path):
    size = np.load(path).dtype["retina_png"].itemsize
    small = encode_png(np.zeros((2, 2, 3), np.uint8)).ljust(size, b"\0")
    assert "different sizes" in refusal(changed(path, retina_png=np.void(small)))


@given(st.data())
@settings(max_examples=150, deadline=None)
def test_altered_bytes_are_detected_without_crashing(data):
    goal_set = make_goal_set(n_goals=2, n_objects=1, shape=(2, 3))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "goals.npy"
        save_goal_set(goal_set, path)
        content = bytearray(path.read_bytes())
        position = data.draw(st.integers(0, len(content) - 1))
        content[position] ^= data.draw(st.integers(1, 255))
        path.write_bytes(content)
        try:
            loaded = load_goal_set(path)
        except GoalSetError:
            return
    assert loaded.sha256 == goal_set.sha256  # the byte was padding


@given(st.integers(min_value=0))
@settings(deadline=None)
def test_no_truncated_file_loads(cut):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "goals.npy"
        save_goal_set(make_goal_set(n_goals=1, n_objects=1, shape=(2, 3)), path)
        content = path.read_bytes()
        path.write_bytes(content[: cut % len(content)])
        refusal(path)


@given(st.binary(max_size=200))
def test_no_bytes_crash_the_png_reader(data):
    png = encode_png(np.zeros((3, 4), np.uint8))
    for content in (data, png[:33] + data):
        try:
            decode_png(content)
        except GoalSetError:
            continue
