"""Locks: one writer, also after the one before was killed; and file systems that have none."""

from __future__ import annotations

import errno
import fcntl
import logging
import os
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from real_bench.files.atomic import OutputError
from real_bench.files.locks import temporary_folder, write_lock
from real_bench.recording import Recording
from tests.cli.shell import COMMAND

PLAY = ("intrinsic", "--controller", "real_r", "--condition", "OM", "--scene", "builtin")
NO_LOCKS = """
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
int flock(int handle, int how) { errno = ENOLCK; return -1; }
"""


def test_second_writer_is_refused_until_the_first_is_done(tmp_path: Path) -> None:
    path = tmp_path / "x"
    with write_lock(path):
        with pytest.raises(OutputError, match="is being written by another process"):
            write_lock(path).__enter__()
        with write_lock(tmp_path / "y"):
            pass
    with write_lock(path):
        pass
    assert not list(tmp_path.iterdir())


def test_one_who_waits_says_so_and_is_next(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path, order = tmp_path / "x", []

    def write() -> None:
        with write_lock(path, wait_while="writes x"):
            order.append("second")

    with caplog.at_level(logging.INFO), ThreadPoolExecutor() as pool:
        with write_lock(path):
            waiting = pool.submit(write)
            while "waiting while another process writes x" not in caplog.text:
                assert not waiting.done()
            order.append("first")
        waiting.result()
    assert order == ["first", "second"]
    assert not list(tmp_path.iterdir())


def test_leftover_lock_file_is_free_to_take(tmp_path: Path) -> None:
    (tmp_path / ".x.lock").touch()
    with write_lock(tmp_path / "x"):
        pass
    assert not list(tmp_path.iterdir())


def test_lock_that_is_a_link_is_refused(tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("kept")
    (tmp_path / ".x.lock").symlink_to("precious")
    with pytest.raises(OutputError, match="cannot write into"):
        write_lock(tmp_path / "x").__enter__()
    assert (tmp_path / "precious").read_text() == "kept"


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL])
def test_file_system_without_locks_gives_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, number: int
) -> None:
    def flock(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "flock", flock)
    with caplog.at_level(logging.WARNING), write_lock(tmp_path / "x"):
        (tmp_path / "x").touch()
    assert [record.message for record in caplog.records] == [
        f"{tmp_path / 'x'} is on a file system without locks: no other process must write it now"
    ]
    assert [path.name for path in tmp_path.iterdir()] == ["x"]


def test_reading_needs_no_lock(place: Path) -> None:
    with (place / "run.h5").open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        with Recording(place / "run.h5") as recording:
            assert recording.n_steps == 2000


def test_commands_work_on_a_file_system_without_locks(place: Path) -> None:
    """All of the command, HDF5 included, where the system's lock always fails."""
    (place / "no.c").write_text(NO_LOCKS)
    built = subprocess.run(["cc", "-shared", "-fPIC", "-o", "no.so", "no.c"], capture_output=True)
    if built.returncode:
        pytest.skip("there is no C compiler")

    def without_locks(*arguments: str) -> subprocess.CompletedProcess[str]:
        env = {**os.environ, "LD_PRELOAD": str(place / "no.so")}
        command = [str(COMMAND), *arguments]
        return subprocess.run(command, env=env, capture_output=True, text=True, timeout=300)

    inspected = without_locks("inspect", "run.h5")
    assert (inspected.returncode, inspected.stderr) == (0, "")
    played = without_locks(*PLAY, "--steps", "2000", "--out", "new.h5")
    assert played.returncode == 0, played.stderr
    assert "new.h5 is on a file system without locks" in played.stderr
    resumed = without_locks("intrinsic", "--resume", "--steps", "3000", "--out", "new.h5")
    assert resumed.returncode == 0, resumed.stderr
    with Recording(place / "new.h5") as recording:
        assert recording.n_steps == 3000


def test_folders_in_use_stay_where_nothing_can_be_locked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(handle: int, how: int) -> None:
        raise OSError(errno.ENOLCK, "no locks")

    monkeypatch.setattr(fcntl, "flock", refuse)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with temporary_folder("mine-") as first, temporary_folder("mine-"):
        assert first.exists()
