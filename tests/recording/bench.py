"""What the tests of recordings and of phases share."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
from numpy.typing import NDArray

from real_bench.recording import Recording
from real_bench.recording.columns import read_poses
from real_bench.recording.schema import POSES

SCENE = "builtin"

EAGER = """
import real_bench.lengths, real_bench.recording.recorder
real_bench.recording.recorder.SECONDS_BETWEEN_WRITES = 0.0
real_bench.lengths.TRIAL_STEPS = 2000
from real_bench.cli import main
main()
"""
PATIENCE_S = 300.0  # only for what would otherwise hang


def realbench(*arguments: object, eager: bool = False) -> list[str]:
    """The command line of the real program.

    An eager one writes its recording at every action, and makes shorter trials.
    """
    program = [str(Path(sys.executable).with_name("realbench"))]
    if eager:
        program = [sys.executable, "-c", EAGER]
    return [*program, *map(str, arguments)]


def run(command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=PATIENCE_S)


def start(
    command: list[str], folder: Path, before: Callable[[], None] | None = None
) -> subprocess.Popen[str]:
    """Start a process in a folder; ``before`` is called in it first."""
    pipe = subprocess.PIPE
    return subprocess.Popen(
        command, cwd=folder, stdout=pipe, stderr=pipe, text=True, preexec_fn=before
    )


def recorded_steps(path: Path) -> int:
    if not path.exists():
        return 0
    with Recording(path) as recording:
        return recording.n_steps


def has_grown(path: Path, n_steps: int) -> bool:
    return recorded_steps(path) > n_steps


def wait_until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def wait_for(process: subprocess.Popen[str], condition: Callable[[], bool]) -> None:
    """Wait until the condition holds, which a process at work must bring about."""

    def holds() -> bool:
        ended = process.poll() is not None
        if condition():
            return True
        assert not ended, process.communicate()
        return False

    wait_until(holds)


def ignore(report: object) -> None:
    """Nobody watches the progress."""


@contextmanager
def edited_poses(file: h5py.File) -> Iterator[NDArray[Any]]:
    """The true poses of a recording, (m, n_objects, 7), to be changed in place."""
    rows = file[POSES][()]
    yield read_poses(rows, int(file.attrs["objects"]))
    file[POSES][...] = rows
