"""Every output option, at everything that a path may lead to.

What is not a plain file stays what it is, whoever else has a name for a file keeps what it names,
and what cannot be written is told in one line before any work.
"""

from __future__ import annotations

import os
import stat
import subprocess
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from real_bench.files.atomic import OutputError, atomic_replacement
from real_bench.files.kinds import (
    GOAL_SET,
    JUNIT,
    RECORDING,
    REPORT,
    RESULT,
    WHOLE,
    FileKind,
)
from real_bench.files.output_streams import Output
from tests.outside.bench import ROOT, Done, as_nobody, command, needs_root, state_of

WHO = ("--controller", "real_r", "--scene", "builtin", "--condition", "OM")
TEST = (*WHO, "--goals", "goals.npy", "--trials", "1", "--overwrite")
PLAY = (*WHO, "--steps", "1000", "--overwrite")
ONE_GOAL = ("--scene", "builtin", "--2d", "1", "--25d", "0", "--3d", "0", "--overwrite")
FILES: dict[str, tuple[str, ...]] = {
    "intrinsic --out": ("intrinsic", *PLAY, "--out"),
    "extrinsic --out": ("extrinsic", *TEST, "--out"),
    "evaluate --out": ("evaluate", *TEST, "--steps", "1000", "--run", "played.h5", "--out"),
    "evaluate --run": ("evaluate", *TEST, "--steps", "1000", "--out", "tested.json", "--run"),
    "goals generate --out": ("goals", "generate", *ONE_GOAL, "--out"),
    "goals show --out": ("goals", "show", "goals.npy", "--overwrite", "--out"),
    "report --out": ("report", "tiny.yaml", "--overwrite", "--out"),
}
FOLDERS: dict[str, tuple[str, ...]] = {
    f"extrinsic {option}": ("extrinsic", *TEST, "--out", "tested.json", option)
    for option in ("--video", "--pictures", "--explain")
} | {"figures --out": ("figures", "run.h5", "--overwrite", "--out")}
STREAMS: dict[str, tuple[str, ...]] = {
    "score --markdown": ("score", "score.json", "--markdown"),
    "score --junit": ("score", "score.json", "--overwrite", "--junit"),
}
KINDS = {
    "intrinsic --out": RECORDING,
    "extrinsic --out": RESULT,
    "evaluate --out": RESULT,
    "evaluate --run": RECORDING,
    "goals generate --out": GOAL_SET,
    "report --out": REPORT,
}
WRITTEN = {"extrinsic --video": "trial-00.mp4", "figures --out": "figures.json"}
JUDGED = (0, 3)  # a trial of the tests is shorter than one should be
SUFFIX = ".png"  # one of the commands insists

Run = Callable[..., Done]


@pytest.fixture
def run(place: Path, capfd: pytest.CaptureFixture[str]) -> Run:
    def run(arguments: tuple[str, ...], path: object) -> Done:
        return command(capfd, *arguments, path)

    return run


def old(option: str) -> bytes:
    """What may be there: a file of another kind would not be replaced."""
    kind = KINDS.get(option)
    return b"old" if kind is None else kind.magic + kind.holds


def refused(done: Done, folder: Path, before: object, told: str) -> None:
    """One line says why, and everything is as it was."""
    assert done.code == 1
    assert "Traceback" not in done.err
    assert done.err.count("realbench: error:") == 1
    assert told in done.last
    assert state_of(folder) == before


class Strange:
    """What a path may lead to, which is not a plain file that may be written."""

    @staticmethod
    def device(path: Path) -> str:
        if not ROOT:
            pytest.skip("only root makes devices")
        os.mknod(path, 0o666 | stat.S_IFCHR, os.makedev(1, 3))
        return "is a device, not a file"

    @staticmethod
    def pipe(path: Path) -> str:
        os.mkfifo(path)
        return "is a pipe, not a file"

    @staticmethod
    def folder(path: Path) -> str:
        path.mkdir()
        return "is a folder, not a file"

    @staticmethod
    def read_only(path: Path) -> str:
        path.write_bytes(b"old")
        path.chmod(0o444)
        return "is read-only: make it writable"

    @staticmethod
    def link_to_itself(path: Path) -> str:
        path.symlink_to(path.name)
        return "Too many levels of symbolic links"

    @staticmethod
    def link_to_a_pipe(path: Path) -> str:
        os.mkfifo(path.with_name("pipe"))
        path.symlink_to("pipe")
        return "is a pipe, not a file"

    @staticmethod
    def long_name(path: Path) -> str:
        return "File name too long"


STRANGE = [name for name in vars(Strange) if not name.startswith("_")]


@pytest.mark.parametrize("strange", STRANGE)
@pytest.mark.parametrize("option", FILES)
def test_unusable_output_file_is_refused(place: Path, run: Run, option: str, strange: str) -> None:
    name = "x" * 300 if strange == "long_name" else "out"
    path = place / f"{name}{SUFFIX}"
    told = getattr(Strange, strange)(path)
    before = state_of(place)
    refused(run(FILES[option], path), place, before, told)


@pytest.mark.parametrize("option", FILES)
def test_hard_link_to_a_replaced_file_keeps_the_old_content(
    place: Path, run: Run, option: str
) -> None:
    path, other = place / f"out{SUFFIX}", place / "other"
    path.write_bytes(old(option))
    os.link(path, other)
    assert run(FILES[option], path).code in JUDGED
    assert other.read_bytes() == old(option)
    assert path.read_bytes() != old(option)


@pytest.mark.parametrize("there", [True, False], ids=["there", "dangling"])
@pytest.mark.parametrize("option", FILES)
def test_a_link_stays_a_link(place: Path, run: Run, option: str, there: bool) -> None:
    path, real = place / f"out{SUFFIX}", place / "elsewhere" / "real"
    real.parent.mkdir()
    if there:
        real.write_bytes(old(option))
    path.symlink_to("elsewhere/real")
    assert run(FILES[option], path).code in JUDGED
    assert path.readlink() == Path("elsewhere/real")
    assert len(real.read_bytes()) > len(old(option))
    assert list(real.parent.iterdir()) == [real]


@pytest.mark.parametrize("option", FILES)
def test_file_mode_is_kept_and_new_files_follow_the_umask(
    place: Path, run: Run, option: str
) -> None:
    there, new = place / f"old{SUFFIX}", place / f"new{SUFFIX}"
    there.write_bytes(old(option))
    there.chmod(0o640)
    before = os.umask(0o077)
    try:
        assert run(FILES[option], there).code in JUDGED
        assert run(FILES[option], new).code in JUDGED
    finally:
        os.umask(before)
    assert stat.S_IMODE(there.stat().st_mode) == 0o640
    assert stat.S_IMODE(new.stat().st_mode) == 0o600


@pytest.mark.parametrize("option", [*FILES, *FOLDERS, *STREAMS])
def test_folder_without_permission_is_refused(place: Path, run: Run, option: str) -> None:
    closed = place / "closed"
    closed.mkdir(mode=0o555)
    before = state_of(place)
    arguments = (FILES | FOLDERS | STREAMS)[option]
    with as_nobody():
        done = run(arguments, closed / f"out{SUFFIX}")
    refused(done, place, before, "Permission denied")


@pytest.mark.parametrize("option", FILES)
def test_full_disk_is_reported(place: Path, full_disk: Path, run: Run, option: str) -> None:
    path = full_disk / f"out{SUFFIX}"
    (full_disk / "old").rename(path)
    path.write_bytes(old(option))
    before = state_of(full_disk)
    refused(run(FILES[option], path), full_disk, before, "No space left on device")


@pytest.mark.parametrize("option", FOLDERS)
def test_full_disk_below_an_output_folder_is_reported(
    place: Path, full_disk: Path, run: Run, option: str
) -> None:
    before = state_of(full_disk)
    done = run(FOLDERS[option], full_disk / "new" if option == "figures --out" else full_disk)
    (full_disk / "new").rmdir() if (full_disk / "new").exists() else None
    refused(done, full_disk, before, "No space left on device")


@pytest.mark.parametrize("strange", ["device", "pipe", "read_only", "link_to_itself", "long_name"])
@pytest.mark.parametrize("option", FOLDERS)
def test_unusable_output_folder_is_refused(
    place: Path, run: Run, option: str, strange: str
) -> None:
    path = place / ("x" * 300 if strange == "long_name" else "out")
    getattr(Strange, strange)(path)
    before = state_of(place)
    refused(run(FOLDERS[option], path), place, before, f"cannot write into {path}")


@pytest.mark.parametrize("option", FOLDERS)
def test_hard_links_to_files_in_a_folder_keep_the_old_content(
    place: Path, run: Run, option: str
) -> None:
    folder, other = place / "real", place / "other"
    (place / "out").symlink_to("real")
    folder.mkdir()
    path = folder / WRITTEN.get(option, "trial-00.png")
    path.write_bytes(b"old")
    os.link(path, other)
    assert run(FOLDERS[option], place / "out").code == 0
    assert other.read_bytes() == b"old"
    assert path.read_bytes() != b"old"
    assert not list(folder.glob(".*"))


@pytest.mark.parametrize("strange", ["folder", "read_only", "link_to_itself"])
@pytest.mark.parametrize("option", STREAMS)
def test_unusable_summary_path_is_refused(place: Path, run: Run, option: str, strange: str) -> None:
    path = place / "out"
    told = getattr(Strange, strange)(path)
    before = state_of(place)
    refused(run(STREAMS[option], path), place, before, told)


@needs_root
@pytest.mark.parametrize("option", STREAMS)
def test_a_device_gets_a_summary_and_stays_a_device(place: Path, run: Run, option: str) -> None:
    path = place / "null"
    Strange.device(path)
    before = state_of(place)
    assert run(STREAMS[option], path).code in JUDGED
    assert state_of(place) == before


@pytest.mark.parametrize("option", STREAMS)
def test_full_device_is_reported(place: Path, run: Run, option: str) -> None:
    refused(run(STREAMS[option], "/dev/full"), place, state_of(place), "No space left on device")


@pytest.mark.parametrize("option", STREAMS)
def test_pipe_with_a_reader_gets_a_summary(place: Path, run: Run, option: str) -> None:
    path, got = place / "pipe", []
    os.mkfifo(path)
    reader = threading.Thread(target=lambda: got.append(path.read_bytes()), daemon=True)
    reader.start()
    while True:  # until the reader is there
        done = run(STREAMS[option], path)
        if done.code != 1:
            break
    reader.join(10)
    assert done.code in JUDGED
    assert b"complete" in got[0]
    assert stat.S_ISFIFO(path.stat().st_mode)


@pytest.mark.parametrize("option", STREAMS)
def test_pipe_without_a_reader_is_refused(place: Path, run: Run, option: str) -> None:
    path = place / "pipe"
    os.mkfifo(path)
    refused(run(STREAMS[option], path), place, state_of(place), "is a pipe that nobody reads")


@pytest.mark.parametrize("option", STREAMS)
@pytest.mark.parametrize("stream", ["/dev/stdout", "/dev/stderr", "/dev/fd/1"])
def test_a_standard_stream_gets_a_summary(place: Path, run: Run, option: str, stream: str) -> None:
    """Here a file that the tests read: what is printed there, too, is not written over."""
    done = run(STREAMS[option], stream)
    assert done.code in JUDGED
    printed = done.err if stream.endswith("err") else done.out
    assert printed.count("complete") >= (1 if stream.endswith("err") else 2)


def test_summary_is_appended_in_place(place: Path, run: Run) -> None:
    path, other = place / "summary.md", place / "other"
    path.write_text("before\n")
    os.link(path, other)
    path.chmod(0o640)
    for _ in range(2):
        assert run(STREAMS["score --markdown"], path).code in JUDGED
    text = path.read_text()
    assert text.startswith("before\n## REAL-R ")
    assert text.count("## REAL-R ") == 2
    assert other.read_text() == text
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_refused_command_leaves_no_empty_summary(place: Path, run: Run) -> None:
    done = run(("score", "none.json", "--markdown"), place / "summary.md")
    assert "result not found: none.json" in done.last
    assert not (place / "summary.md").exists()


@pytest.mark.parametrize("kind", WHOLE, ids=lambda kind: kind.name)
@pytest.mark.parametrize("option", STREAMS)
def test_a_summary_spoils_no_other_kind_of_file(
    place: Path, run: Run, option: str, kind: FileKind
) -> None:
    path, content = place / "other", kind.magic + b"..." + kind.holds
    path.write_bytes(content)
    done = run(STREAMS[option], path)
    if (option, kind) == ("score --junit", JUNIT):
        assert done.code in JUDGED
        return
    assert f"{path} is " in done.last
    assert path.read_bytes() == content


def test_a_summary_that_another_process_has_begun_is_not_removed(place: Path) -> None:
    path = place / "summary.md"
    with Output(path, append=True), Output(path, append=True) as other:
        other.write(b"theirs")
    assert path.read_bytes() == b"theirs"


def test_what_fails_while_a_file_is_written_is_not_said_of_the_file(place: Path) -> None:
    with pytest.raises(ValueError, match="invalid literal"), atomic_replacement(place / "new"):
        int("x")
    with pytest.raises(FileNotFoundError), atomic_replacement(place / "new"):
        (place / "none").read_bytes()
    with (
        pytest.raises(OutputError, match=r"cannot write .*new: No space left"),
        atomic_replacement(place / "new"),
        Path("/dev/full").open("wb", buffering=0) as full,
    ):
        full.write(b"x")
    assert not [path for path in place.iterdir() if path.name.startswith((".", "new"))]


@needs_root
@pytest.mark.parametrize("option", [*FILES, *STREAMS])
def test_file_mounted_by_itself_is_never_replaced(place: Path, run: Run, option: str) -> None:
    """As a container has it; its name has what the list of mounts writes otherwise."""
    path, source = place / f"o ut\\{SUFFIX}", place / "source"
    path.touch()
    source.write_bytes(b"old")
    if subprocess.run(["mount", "--bind", source, path], capture_output=True).returncode:
        pytest.skip("nothing can be mounted here")
    try:
        if option == "score --markdown":
            assert run(STREAMS[option], path).code in JUDGED
            assert source.read_bytes().startswith(b"old## REAL-R ")
            return
        before = state_of(place)
        done = run((FILES | STREAMS)[option], path)
        refused(done, place, before, "is mounted by itself and cannot be replaced")
    finally:
        subprocess.run(["umount", path], check=True)


@pytest.mark.parametrize("option", FILES)
def test_output_file_that_is_standard_output_is_refused(
    place: Path, option: str, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = tmp_path / f"log{SUFFIX}"
    kept = os.dup(1)
    with path.open("wb") as log:
        os.dup2(log.fileno(), 1)
        try:
            done = command(capfd, *FILES[option], path)
        finally:
            os.dup2(kept, 1)
            os.close(kept)
    assert done.code == 1
    assert "is where this command prints to" in done.last
