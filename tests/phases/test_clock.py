"""A clock that goes backwards: set by hand, by NTP, or by a battery that is empty."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from real_bench.recording import Recording
from real_bench.scoring.result import Result, load_result
from tests.cli.shell import realbench as called
from tests.recording.bench import realbench, recorded_steps, wait_for

LIBRARY = next(Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1"), None)

pytestmark = pytest.mark.skipif(LIBRARY is None, reason="libfaketime is not installed")


class Clock:
    """What programs take for the time of day; their monotonic clock is the real one."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self.set("+0")

    def set(self, shift: str) -> None:
        """As seen by programs that run already, too."""
        self._file.write_text(f"{shift}\n")

    @property
    def environment(self) -> dict[str, str]:
        return {
            **os.environ,
            "LD_PRELOAD": str(LIBRARY),
            "FAKETIME_TIMESTAMP_FILE": str(self._file),
            "FAKETIME_NO_CACHE": "1",
            "FAKETIME_DONT_FAKE_MONOTONIC": "1",
        }


@pytest.fixture
def clock(tmp_path: Path) -> Clock:
    return Clock(tmp_path / "clock")


def started(command: list[str], folder: Path, clock: Clock) -> subprocess.Popen[str]:
    pipe = subprocess.PIPE
    return subprocess.Popen(
        command, cwd=folder, env=clock.environment, stdout=pipe, stderr=pipe, text=True
    )


def ended_well(process: subprocess.Popen[str]) -> None:
    _, told = process.communicate(timeout=300)
    assert process.returncode == 0, told


def transitions(path: Path) -> list[bytes]:
    with Recording(path) as recording:
        assert recording.ended
        return [one.tobytes() for one in recording.transitions]


def test_fake_clock_goes_backwards(tmp_path: Path, clock: Clock) -> None:
    """Or what follows would show nothing."""
    program = "import time\nprint(time.time(), flush=True)\ninput()\nprint(time.time())"
    told = [sys.executable, "-c", program]
    process = subprocess.Popen(
        told, env=clock.environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    first = float(process.stdout.readline())
    clock.set("-1d")
    last, _ = process.communicate("\n", timeout=60)
    assert float(last) < first - 86_000


def test_clock_change_leaves_a_play_the_same_and_resumable(tmp_path: Path, clock: Clock) -> None:
    play = ["intrinsic", "--controller", "real_r", "--condition", "OM", "--scene", "builtin"]
    told = [*play, "--steps", "14000", "--out"]
    called(tmp_path, *told, "as-ever.h5")
    process = started(realbench(*told, "shifted.h5", eager=True), tmp_path, clock)
    wait_for(process, lambda: recorded_steps(tmp_path / "shifted.h5") >= 3000)
    clock.set("-1d")
    assert process.poll() is None  # or nothing would be shown
    ended_well(process)
    assert transitions(tmp_path / "shifted.h5") == transitions(tmp_path / "as-ever.h5")

    clock.set("+0")
    process = started(realbench(*told, "cut.h5", eager=True), tmp_path, clock)
    wait_for(process, lambda: recorded_steps(tmp_path / "cut.h5") >= 3000)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    clock.set("-300d")
    ended_well(started(realbench(*told, "cut.h5", "--resume"), tmp_path, clock))
    assert len(transitions(tmp_path / "cut.h5")) == 14


def command(goals_path: Path, out: Path, *options: str) -> list[str]:
    told = ["extrinsic", "--controller", "real_r", "--condition", "OM", "--scene", "builtin"]
    return [*told, "--trial-steps", "3000", "--goals", str(goals_path), *options, "--out", str(out)]


@pytest.fixture(scope="module")
def tested(goals_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Result:
    """A test while the clock goes on as ever."""
    out = tmp_path_factory.mktemp("tested") / "as-ever.json"
    called(out.parent, *command(goals_path, out))
    return load_result(out)


@pytest.mark.parametrize("options", [[], ["--isolate"], ["--jobs", "2"]])
def test_clock_change_leaves_a_test_the_same(
    tmp_path: Path, goals_path: Path, tested: Result, clock: Clock, options: list[str]
) -> None:
    out = tmp_path / "shifted.json"
    process = started(realbench(*command(goals_path, out, *options)), tmp_path, clock)
    wait_for(process, lambda: out.exists() and bool(load_result(out).trials))
    clock.set("-1d")
    assert process.poll() is None  # or nothing would be shown
    ended_well(process)
    shifted = load_result(out)
    assert shifted.trials == tested.trials
    assert all(0 <= seconds < 300 for seconds in shifted.seconds.values())
