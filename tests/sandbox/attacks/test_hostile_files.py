"""Files from strangers: each is refused by an error of ours, before it takes time or memory."""

from __future__ import annotations

import json
import resource
import struct
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from shutil import copyfile
from typing import Any

import h5py
import hdf5plugin
import numpy as np
import pytest

from real_bench.errors import ControllerError, RecordingError, SceneError
from real_bench.goal_sets import GoalSet, save_goal_set
from real_bench.recording import Recording
from real_bench.recording.schema import STATE, TRANSITION
from real_bench.scoring.result import Result
from real_bench.settings import read_settings
from real_bench.simulation import Scene, load_scene
from real_bench.simulation.scene import read_manifest
from tests.cli.shell import TOUCHES, realbench, write_controller
from tests.sandbox.conftest import Play

pytestmark = pytest.mark.attacks

GIB = 2**30


@pytest.fixture(scope="module")
def secret(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("secret") / "secret.h5"
    with h5py.File(path, "w") as file:
        file["states"] = np.zeros(3, STATE)
        file["transitions"] = np.zeros(3, TRANSITION)
    return path


def external_link(file: h5py.File, secret: Path) -> None:
    del file["states"]
    file["states"] = h5py.ExternalLink(secret, "states")


def external_link_to_a_group(file: h5py.File, secret: Path) -> None:
    del file["controller_state"]
    file["controller_state"] = h5py.ExternalLink(secret, "/")


def soft_link(file: h5py.File, secret: Path) -> None:
    file.move("states", "other")
    file["states"] = h5py.SoftLink("/other")


def soft_link_in_a_circle(file: h5py.File, secret: Path) -> None:
    del file["states"]
    file["states"] = h5py.SoftLink("/states")


def rows_in_another_file(file: h5py.File, secret: Path) -> None:
    n = len(file["states"])
    del file["states"]
    place = [(str(secret), 0, n * STATE.itemsize)]
    file.create_dataset("states", (n,), STATE, external=place)


def virtual_rows(file: h5py.File, secret: Path) -> None:
    n = len(file["states"])
    del file["states"]
    layout = h5py.VirtualLayout((n,), STATE)
    layout[:] = h5py.VirtualSource(secret, "states", (3,))[:n]
    file.create_virtual_dataset("states", layout)


def giant_shape(file: h5py.File, secret: Path) -> None:
    file["transitions"].resize((2**40,))


def giant_shape_of_images(file: h5py.File, secret: Path) -> None:
    del file["images"]
    file.create_dataset("images", (2**40, 240, 320, 3), "u1", chunks=(16, 240, 320, 3))


def giant_shape_without_pieces(file: h5py.File, secret: Path) -> None:
    del file["cuts"]
    file.create_dataset("cuts", (2**36,), np.uint8)


def giant_piece(file: h5py.File, secret: Path) -> None:
    del file["images"]
    file.create_dataset("images", (1, 2**15, 2**15, 3), "u1", chunks=(1, 2**15, 2**15, 3))


def many_equal_rows(file: h5py.File, secret: Path) -> None:
    """A gigabyte that takes some kilobytes."""
    del file["cuts"]
    dtype = np.dtype([("step", "<i8"), ("controller_sha256", "S64"), ("versions", "S1024")])
    rows = 2**20
    zstd = hdf5plugin.Zstd()
    data = file.create_dataset("cuts", (rows,), dtype, chunks=(2**16,), **zstd)
    data[: 2**16] = np.zeros(2**16, dtype)
    piece = data.id.read_direct_chunk((0,))[1]
    for first in range(2**16, rows, 2**16):
        data.id.write_direct_chunk((first,), piece)


def bomb(n_bytes: int) -> bytes:
    """A frame of zstd that unpacks to zeros: a frame header, and blocks of one repeated byte."""
    blocks, block = -(-n_bytes // 2**17), 2**17
    frame = b"\x28\xb5\x2f\xfd" + bytes([0xC0, 0x58]) + struct.pack("<Q", blocks * block)
    for number in range(blocks):
        frame += ((block << 3) | (1 << 1) | (number == blocks - 1)).to_bytes(3, "little") + b"\0"
    return frame


def packed_bomb(file: h5py.File, secret: Path) -> None:
    """A stream of zlib that unpacks to 2 GiB."""
    packer, n_pieces, size = zlib.compressobj(9, wbits=-15), 128, 2**24
    piece = packer.compress(bytes(size)) + packer.flush(zlib.Z_FULL_FLUSH)  # does not look back
    checksum = struct.pack(">I", (n_pieces * size % 65521 << 16) | 1)
    file["states"].id.write_direct_chunk(
        (0,), b"\x78\xda" + n_pieces * piece + packer.flush() + checksum
    )


def packed_bomb_of_commands(file: h5py.File, secret: Path) -> None:
    file["commands"].id.write_direct_chunk((0,), zlib.compress(bytes(2**26)))


def packed_by_nobody(file: h5py.File, secret: Path) -> None:
    file["states"].id.write_direct_chunk((0,), b"no stream of zlib")


def packed_bomb_of_images(file: h5py.File, secret: Path) -> None:
    file["images"].id.write_direct_chunk((0, 0, 0, 0), bomb(8 * GIB))


def another_packing(file: h5py.File, secret: Path) -> None:
    del file["states"]
    n = len(file["ground_truth/object_poses"])
    file.create_dataset("states", data=np.zeros(n, STATE), compression="gzip", chunks=(1,))


def text_for_rows(file: h5py.File, secret: Path) -> None:
    n = len(file["states"])
    del file["states"]
    file.create_dataset("states", (n,), h5py.string_dtype())


def many_attributes(file: h5py.File, secret: Path) -> None:
    del file.attrs["condition"]
    file.attrs.create("condition", ["x" * 1000] * 50, dtype=h5py.string_dtype())


def state_that_counts_one_array_often(file: h5py.File, secret: Path) -> None:
    state = {str(n): {"__kept_as__": "array", "number": 0} for n in range(10_000)}
    _state(file, json.dumps(state), np.zeros(2**20))


def state_of_objects(file: h5py.File, secret: Path) -> None:
    _state(file, '{"a": {"__kept_as__": "array", "number": 0}}', None)
    file["controller_state"].create_dataset("0", (1,), h5py.string_dtype())


def deep_state(file: h5py.File, secret: Path) -> None:
    _state(file, '{"a":' * 100_000, None)


def giant_state(file: h5py.File, secret: Path) -> None:
    _state(file, '{"a": {"__kept_as__": "array", "number": 0}}', None)
    file["controller_state"].create_dataset("0", (2**40,), "f8", chunks=(1024,))


def images_in_another_file(file: h5py.File, secret: Path) -> None:
    del file["images"]
    file["images"] = h5py.ExternalLink(secret.with_name("nowhere.h5"), "images")


def images_that_are_a_group(file: h5py.File, secret: Path) -> None:
    del file["images"]
    file.create_group("images")


def state_in_another_file(file: h5py.File, secret: Path) -> None:
    _state(file, '{"a": {"__kept_as__": "array", "number": 0}}', None)
    link = h5py.ExternalLink(secret.with_name("nowhere.h5"), "0")
    file["controller_state"]["0"] = link


def state_of_groups(file: h5py.File, secret: Path) -> None:
    _state(file, '{"a": {"__kept_as__": "array", "number": 0}}', None)
    file["controller_state"].create_group("0")


def packed_state(file: h5py.File, secret: Path) -> None:
    _state(file, '{"a": {"__kept_as__": "array", "number": 0}}', None)
    zeros = {"data": np.zeros(2**24), "chunks": (2**24,), **hdf5plugin.Zstd()}
    file["controller_state"].create_dataset("0", **zeros)


def _state(file: h5py.File, structure: str, array: Any) -> None:
    del file["controller_state"]
    group = file.create_group("controller_state")
    group.create_dataset("structure", data=np.frombuffer(structure.encode(), np.uint8))
    if array is not None:
        group.create_dataset("0", data=array)


Alter = Callable[[h5py.File, Path], None]
HDF5: list[Alter] = [
    external_link,
    external_link_to_a_group,
    soft_link,
    soft_link_in_a_circle,
    rows_in_another_file,
    virtual_rows,
    giant_shape,
    giant_shape_of_images,
    giant_shape_without_pieces,
    giant_piece,
    many_equal_rows,
    packed_bomb,
    packed_bomb_of_commands,
    packed_bomb_of_images,
    packed_by_nobody,
    another_packing,
    text_for_rows,
    many_attributes,
    state_that_counts_one_array_often,
    state_of_objects,
    deep_state,
    giant_state,
    images_in_another_file,
    images_that_are_a_group,
    state_in_another_file,
    state_of_groups,
    packed_state,
]


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from real_bench.conditions import Condition
    from real_bench.phases.intrinsic import IntrinsicPhase
    from tests.recording.bench import ignore

    path = tmp_path_factory.mktemp("honest") / "run.h5"
    scene = load_scene("builtin")
    IntrinsicPhase("real_r", Condition.parse("IM"), 1, scene, 1000, 0, path).run(ignore)
    return path


def read_all(path: Path) -> None:
    with Recording(path) as recording:
        recording.states, recording.object_poses, recording.commands(), recording.images()
        recording.controller_state()


def test_an_honest_recording_is_read(honest: Path) -> None:
    read_all(honest)


@pytest.fixture
def little_memory() -> Any:
    """What is to be refused must not be tried first."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + GIB, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is limited by /proc")
@pytest.mark.parametrize("alter", HDF5, ids=lambda alter: alter.__name__)
def test_hdf5(
    honest: Path, secret: Path, tmp_path: Path, little_memory: None, alter: Alter
) -> None:
    path = tmp_path / "altered.h5"
    copyfile(honest, path)
    with h5py.File(path, "r+") as file:
        alter(file, secret)
    with pytest.raises(RecordingError) as caught:
        read_all(path)
    assert "\n" not in str(caught.value)
    assert "MemoryError" not in str(caught.value)
    assert "allocate" not in str(caught.value)


@pytest.mark.parametrize("alter", [images_in_another_file, state_in_another_file])
def test_links_are_refused_unfollowed(
    honest: Path, secret: Path, tmp_path: Path, alter: Alter
) -> None:
    """What a link leads to may be a pipe that nobody writes into."""
    path = tmp_path / "altered.h5"
    copyfile(honest, path)
    with h5py.File(path, "r+") as file:
        alter(file, secret)
    with pytest.raises(RecordingError, match="is not a dataset of the file"):
        read_all(path)


YAML = {
    "laughs": "a: &a [x, x]\n"
    + "".join(
        f"{b}: &{b} [*{a}, *{a}, *{a}, *{a}]\n"
        for a, b in zip("abcdefghijklmnopqrstuvwxy", "bcdefghijklmnopqrstuvwxyz", strict=True)
    ),
    "merges": "a: &a {x: 1}\n"
    + "".join(
        f"{b}: &{b} {{<<: [*{a}, *{a}, *{a}, *{a}, *{a}, *{a}, *{a}, *{a}]}}\n"
        for a, b in zip("abcdefghijklmnopqrstuvwxy", "bcdefghijklmnopqrstuvwxyz", strict=True)
    ),
    "itself": "a: &a [*a]",
    "deep": "[" * 50_000,
    "deep maps": "{a: " * 20_000,
    "objects": "a: !!python/object/apply:os.system [echo]",
    "names": "a: !!python/name:os.system",
    "a long number": "a: " + "9" * 60_000,
    "base sixty": "a: 1" + ":59" * 20_000,
    "too long": "# " + "x" * 2**21,
    "zeros": "\0" * 100,
    "not text": "\udcff",
}


@pytest.mark.parametrize("name", YAML)
def test_yaml(tmp_path: Path, name: str) -> None:
    path = tmp_path / "hostile.yaml"
    path.write_text(YAML[name], errors="surrogateescape")
    with pytest.raises(ControllerError, match=r"the settings file|--set"):
        read_settings(path, [])
    with pytest.raises(SceneError):
        read_manifest(path)


def test_yaml_on_the_command_line() -> None:
    with pytest.raises(ControllerError):
        read_settings(None, ["a=&a [*a]"])


def header(text: str) -> bytes:
    content = text.encode().ljust(118) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(content)) + content


def npy(dtype: str, shape: str) -> bytes:
    return header(f"{{'descr': {dtype}, 'fortran_order': False, 'shape': {shape}, }}")


NPY = {
    "giant": npy("'<f8'", "(1099511627776,)"),
    "overflowing": npy("'<f8'", "(4611686018427387904, 4)"),
    "negative": npy("'<f8'", "(-1,)"),
    "objects": npy("'|O'", "(1,)") + b"\x80\x04cos\nsystem\n(S'echo'\ntR.",
    "a program": header("__import__('os').system('echo')"),
    "deep": header("(" * 100),
    "a long header": b"\x93NUMPY\x02\x00" + struct.pack("<I", 2**32 - 1),
    "giant rows": npy("[('format', '<U16'), ('x', 'V2147483647')]", "(1000000,)"),
    "many fields": npy("[('format', '<U16')] * 3", "(1,)"),
    "nothing": b"",
    "a pickle": b"\x80\x04cos\nsystem\n(S'echo'\ntR.",
}

SHOW = "import sys; from real_bench.cli import main; main(['goals', *sys.argv[1:]])"
LIMITED = f"import resource; resource.setrlimit(resource.RLIMIT_DATA, ({2 * GIB},) * 2); {SHOW}"


@pytest.mark.parametrize("name", NPY)
def test_npy(tmp_path: Path, name: str) -> None:
    from real_bench.errors import GoalSetError
    from real_bench.goal_sets import load_goal_set

    path = tmp_path / "hostile.npy"
    path.write_bytes(NPY[name])
    with pytest.raises(GoalSetError):
        load_goal_set(path)


def pickled(code: bytes) -> bytes:
    return npy("'|O'", "(1,)") + code


NPZ = {
    "a bomb": b"\0" * 2**28,
    "a program": pickled(b"\x80\x04cos\nsystem\n(S'touch ran'\ntR."),
    "an extension": pickled(b"\x80\x02\x82\x01."),
    "a laugh": pickled(b"\x80\x04]q\x00" + b"]q\x01(h\x00h\x00h\x00e" * 100 + b"."),
    "a name of ours": pickled(b"\x80\x04creal_bench.cli\nmain\n)R."),
    "text that is long": pickled(b"\x80\x04X\xff\xff\xff\x7f."),
}


@pytest.mark.parametrize("name", NPZ)
def test_npz(tmp_path: Path, name: str) -> None:
    """Official goal files, which hold pickles; in a process of its own, whose memory is limited."""
    path = tmp_path / "hostile.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("arr_0.npy", NPZ[name])
    command = ["import", str(path), "--scene", "builtin", "--out", "goals.npy"]
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, *command],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1, done.stderr
    assert done.stderr.startswith("realbench: error: ")
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "ran").exists()


def test_excerpt_of_a_recording_contains_no_poses(play: Play, tmp_path: Path) -> None:
    """Poses are not even somewhere in the bytes of the file."""
    from real_bench.conditions import Condition
    from real_bench.recording import Experience
    from real_bench.recording.excerpt import write_excerpt

    run = play("real_r", 2000, condition="IM")
    with Recording(run) as recording:
        poses = recording.object_poses
    excerpt = tmp_path / "excerpt.h5"
    write_excerpt(Experience(run, Condition.parse("IM")), excerpt)
    content = excerpt.read_bytes()
    assert b"ground_truth" not in content
    assert poses[-1].tobytes() not in content
    with Recording(excerpt) as recording, pytest.raises(RecordingError, match="without positions"):
        recording.object_poses  # noqa: B018


@pytest.fixture(scope="module")
def tested(scene: Scene, goals: GoalSet, tmp_path_factory: pytest.TempPathFactory) -> Result:
    """A result as it was made."""
    from real_bench.conditions import Condition
    from real_bench.phases.extrinsic import ExtrinsicPhase
    from real_bench.phases.trial import TrialPlan
    from tests.recording.bench import ignore

    plan = TrialPlan("real_r", Condition.parse("OM"), scene, goals, 0, 10_000)
    out = tmp_path_factory.mktemp("tested") / "score.json"
    return ExtrinsicPhase(plan, len(goals), out).run(ignore)


@pytest.mark.parametrize("command", ["report", "figures", "score", "compare", "verify"])
@pytest.mark.parametrize("named", ["evil.py", "evil:Evil"])
def test_a_result_that_names_code(
    tested: Result,
    goals: GoalSet,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: str,
    named: str,
) -> None:
    """No command that only reads a result runs what is named in it."""
    write_controller(tmp_path / "evil.py", *TOUCHES)
    setting = tested.setting.model_copy(update={"controller": named})
    tested.model_copy(update={"setting": setting}).save(tmp_path / "forged.json")
    save_goal_set(goals, tmp_path / "goals.npy")
    options = {
        "compare": ["forged.json"],
        "verify": ["--goals", "goals.npy"],
        "score": ["--goals", "goals.npy"],
    }
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    realbench(tmp_path, command, "forged.json", *options.get(command, []))
    assert not (tmp_path / "touched").exists()


@pytest.mark.skipif(sys.version_info < (3, 11), reason="needs PYTHONSAFEPATH")
@pytest.mark.parametrize("command", ["score", "table"])
def test_code_in_the_current_folder(tmp_path: Path, goals: GoalSet, command: str) -> None:
    """Files that are named like Python's own modules, beside the submission."""
    for name in ("pickle", "random", "runpy", "json", "logging", "numpy"):
        (tmp_path / f"{name}.py").write_text("open('touched', 'w')\n")
    save_goal_set(goals, tmp_path / "goals.npy")
    (tmp_path / "mine.yaml").write_text(
        "{scene: builtin, trial_steps: 1000, goals: {few: goals.npy}, "
        "cells: [{controller: real_r, condition: OM, play: none}]}"
    )
    test = ["--controller", "real_r", "--condition", "OM", "--scene", "builtin", "--jobs", "2"]
    test += ["--goals", "goals.npy", "--trial-steps", "1000"]
    options = {"score": test, "table": ["mine.yaml", "--isolate"]}
    done = realbench(tmp_path, command, *options[command], code=3 if command == "score" else 0)
    assert "not passed: length" in done.stderr or command == "table"
    assert not (tmp_path / "touched").exists()
