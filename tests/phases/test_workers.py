"""Work that is shared among processes."""

from __future__ import annotations

import os
import pickle
import select
import subprocess
import sys
from pathlib import Path

import pytest

from real_bench.files.locks import temporary_folder
from real_bench.phases.workers import _run_task, _WorkerState
from tests.recording.bench import PATIENCE_S

DIES_AT_ONCE = """
import multiprocessing, sys
from functools import partial

from real_bench.errors import RealBenchError
from real_bench.phases.stopping import stop_requests
from real_bench.phases.workers import in_processes

multiprocessing.set_executable(sys.argv[1])
with stop_requests() as stop:
    try:
        list(in_processes(partial(print, bytes(10_000_000)), [1, 2], 2, stop, "try again"))
    except RealBenchError as error:
        sys.exit(str(error))
"""


def test_workers_that_die_at_once_are_reported(tmp_path: Path) -> None:
    """However much they were to be told."""
    python = tmp_path / "python"
    python.write_text(
        f'#!/bin/sh\ncase "$*" in *resource_tracker*) exec {sys.executable} "$@";; esac\nexit 1\n'
    )
    python.chmod(0o755)
    told = [sys.executable, "-c", DIES_AT_ONCE, str(python)]
    done = subprocess.run(told, capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == "a worker process died; try again"


NO_GUARD = """
import sys
import real_bench

test = {"condition": "OM", "scene": "builtin", "trials": 2, "trial_steps": 500, "jobs": 2}
print(real_bench.run_extrinsic("real_r", **test).score)
"""


def test_script_is_not_run_again_by_its_workers(tmp_path: Path) -> None:
    """Though it has no ``if __name__ == "__main__"``."""
    (tmp_path / "script.py").write_text(NO_GUARD)
    told = [sys.executable, "script.py"]
    done = subprocess.run(told, capture_output=True, text=True, cwd=tmp_path, timeout=PATIENCE_S)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 1


def test_folder_of_a_killed_process_is_removed_by_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    killed = (
        "import os, signal\n"
        "from real_bench.files.locks import temporary_folder\n"
        "with temporary_folder('mine-') as folder:\n"
        "    (folder / 'part').write_text('kept')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", killed], env=environment, check=False)
    (left,) = tmp_path.glob("mine-*")
    with temporary_folder("mine-") as first, temporary_folder("mine-") as second:
        assert not left.exists()
        assert first.exists()
        assert first != second
        with temporary_folder("other-"):
            assert len(list(tmp_path.glob("[!.]*"))) == 3
    assert list(tmp_path.iterdir()) == []


MANY = """
from real_bench.files.locks import temporary_folder

for _ in range(200):
    with temporary_folder("mine-") as folder:
        (folder / "part").touch()
"""


def test_cleaning_up_does_not_disturb_processes_that_start(tmp_path: Path) -> None:
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    told = [sys.executable, "-c", MANY]
    processes = [subprocess.Popen(told, env=environment) for _ in range(4)]
    assert [process.wait(PATIENCE_S) for process in processes] == [0] * 4
    assert list(tmp_path.iterdir()) == []


def test_results_pass_by_file_not_through_the_pipe(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So little that it arrives at once or not at all, whenever a worker is killed."""
    monkeypatch.setattr(_WorkerState, "folder", tmp_path, raising=False)
    monkeypatch.setattr(_WorkerState, "worker", bytes)
    done = _run_task(5_000_000)
    assert len(pickle.dumps(done)) < select.PIPE_BUF
    assert pickle.loads(done.read_bytes()) == bytes(5_000_000)


@pytest.mark.parametrize("trap", ["deep", "closed"])
def test_folder_is_removed_whatever_it_contains(tmp_path: Path, trap: str) -> None:
    traps = {
        "deep": "for _ in range(1500): os.mkdir('d'); os.chdir('d')",
        "closed": "os.makedirs('d/e'); os.chmod('d', 0)",
    }
    told = (
        "import os\n"
        "from real_bench.files.locks import temporary_folder\n"
        "with temporary_folder('mine-') as folder:\n"
        "    os.chdir(folder)\n"
        f"    {traps[trap]}\n"
    )
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", told], env=environment, check=True)
    assert list(tmp_path.iterdir()) == []


def test_only_our_own_folders_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    notes = tmp_path / "mine-notes"
    notes.mkdir()
    (tmp_path / f"mine-{'0' * 32}").symlink_to(notes)
    with temporary_folder("mine-"):
        pass
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"mine-{'0' * 32}", "mine-notes"]
