from __future__ import annotations

import os
import signal
import subprocess
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from real_bench.experiments import read_spec
from real_bench.experiments.jobs import PlayJob, job_from_json
from real_bench.experiments.plan import ExperimentPlan
from real_bench.experiments.process import (
    JobFailedError,
    JobStoppedError,
    Processes,
    WorkerLostError,
)
from real_bench.recording import Recording
from tests.cli.shell import write_controller
from tests.experiments.conftest import WriteSpec


def a_play(write_spec: WriteSpec, controller: str = "real_r", steps: int = 3000) -> PlayJob:
    cell = {"controller": controller, "condition": "OM", "name": "cell"}
    spec = read_spec(write_spec(cells=[cell], steps=steps))
    spec.results_folder.mkdir()
    return ExperimentPlan(spec).pending().plays[0]


def test_job_survives_serialisation(write_spec: WriteSpec) -> None:
    job = a_play(write_spec)
    assert job_from_json(job.model_dump_json()) == job


def test_job_is_done_with_its_progress_reported(write_spec: WriteSpec, tmp_path: Path) -> None:
    job = a_play(write_spec)
    steps: list[int] = []
    Processes(tmp_path / "logs").do(job, lambda done, busy="": steps.append(done))
    with Recording(job.out) as recording:
        assert recording.n_steps == 3000
        assert recording.ended
    assert steps == sorted(steps)
    assert (tmp_path / "logs" / f"{job.name}.log").exists()


def test_controller_output_is_logged_and_harmless(write_spec: WriteSpec, tmp_path: Path) -> None:
    write_controller(
        tmp_path / "loud.py",
        "def next_action(self, observation):",
        """    print('{"failed": "no"}', flush=True)""",
        "    return super().next_action(observation)",
    )
    job = a_play(write_spec, "loud.py")
    Processes(tmp_path / "logs").do(job, lambda done, busy="": None)
    assert '"failed"' in (tmp_path / "logs" / f"{job.name}.log").read_text()


def test_failing_controller_is_reported(write_spec: WriteSpec, tmp_path: Path) -> None:
    raises = "raise ValueError('no idea')"
    write_controller(tmp_path / "bad.py", f"def next_action(self, observation): {raises}")
    job = a_play(write_spec, "bad.py")
    with pytest.raises(JobFailedError, match="no idea"):
        Processes(tmp_path / "logs").do(job, lambda done, busy="": None)


def test_error_that_nobody_foresaw_is_no_lost_worker(write_spec: WriteSpec, tmp_path: Path) -> None:
    spoils = "from real_bench.recording import Recorder\nRecorder.add_state = lambda *_: 1 / 0"
    write_controller(tmp_path / "spoils.py", "pass", before=spoils)
    job = a_play(write_spec, "spoils.py")
    with pytest.raises(JobFailedError, match=r"spoils\.py, line 2: ZeroDiv") as caught:
        Processes(tmp_path / "logs").do(job, lambda done, busy="": None)
    assert caught.value.kind == "ZeroDivisionError"


@pytest.mark.parametrize("end", ["os.kill(os.getpid(), 9)", "os._exit(3)"])
def test_process_that_dies_raises_worker_lost(
    write_spec: WriteSpec, tmp_path: Path, end: str
) -> None:
    method = f"def next_action(self, observation): {end}"
    write_controller(tmp_path / "dies.py", method, before="import os")
    told = "SIGKILL" if "kill" in end else "exit code 3"
    job = a_play(write_spec, "dies.py")
    with pytest.raises(WorkerLostError, match=told):
        Processes(tmp_path / "logs").do(job, lambda done, busy="": None)


def test_process_that_is_asked_to_stop_counts_as_lost(
    write_spec: WriteSpec, tmp_path: Path
) -> None:
    processes = Processes(tmp_path / "logs")
    asked: list[subprocess.Popen[str]] = []

    def stop(done: int, busy: str = "") -> None:
        if not asked:
            asked.extend(processes._running)
            asked[0].terminate()

    with pytest.raises(WorkerLostError, match="stopped at step"):
        processes.do(a_play(write_spec, steps=100_000_000), stop)


def test_controller_that_is_asked_to_stop_may_be_tried_again(
    write_spec: WriteSpec, tmp_path: Path
) -> None:
    stops = "def next_action(self, observation): os.kill(os.getpid(), 15)"
    write_controller(tmp_path / "stops.py", stops, before="import os")
    job = a_play(write_spec, "stops.py").model_copy(update={"isolate": True})
    with pytest.raises(JobStoppedError, match="killed by SIGTERM in next_action") as caught:
        Processes(tmp_path / "logs").do(job, lambda done, busy="": None)
    assert caught.value.kind == "ControllerStoppedError"


def test_stop_ends_the_running_job(write_spec: WriteSpec, tmp_path: Path) -> None:
    job = a_play(write_spec, steps=100_000_000)
    processes = Processes(tmp_path / "logs")
    begun = threading.Event()

    def stop_once_begun() -> None:
        begun.wait(60)
        processes.stop()

    threading.Thread(target=stop_once_begun, daemon=True).start()
    with pytest.raises(WorkerLostError):
        processes.do(job, lambda done, busy="": begun.set())
    with pytest.raises(WorkerLostError, match="not started"):
        processes.do(job, lambda done, busy="": None)
    with Recording(job.out) as recording:  # whole, as far as it came
        assert not recording.ended


def test_job_that_starts_while_all_are_stopped_ends(
    write_spec: WriteSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    processes, start = Processes(tmp_path / "logs"), Processes._process

    def start_late(log: Any) -> Any:
        process = start(log)
        processes.stop()  # does not know of it yet
        return process

    monkeypatch.setattr(processes, "_process", start_late)
    with pytest.raises(WorkerLostError, match="SIGKILL"):
        processes.do(a_play(write_spec, steps=100_000_000), lambda done, busy="": None)


def test_process_ends_with_its_parent(write_spec: WriteSpec, tmp_path: Path) -> None:
    """Fork, ask, die: the process that did the job is gone soon after."""
    tells = f"pathlib.Path({str(tmp_path / 'pid')!r}).write_text(str(os.getpid()))"
    method = f"def start_intrinsic_phase(self): {tells}"
    write_controller(tmp_path / "tells.py", method, before="import os, pathlib")
    job = a_play(write_spec, "tells.py", steps=100_000_000)
    parent = os.fork()
    if parent == 0:
        try:
            Processes(tmp_path / "logs").do(job, lambda done, busy="": None)
        finally:
            os._exit(1)
    pid = int(_soon(lambda: (tmp_path / "pid").read_text()))
    os.kill(parent, signal.SIGKILL)
    os.waitpid(parent, 0)
    _soon(lambda: _is_gone(pid))


def _soon(ask: object) -> str:
    """What a function gives once it gives something, within a generous minute."""
    assert callable(ask)
    end = time.monotonic() + 60
    while time.monotonic() < end:
        try:
            if answer := ask():
                return str(answer)
        except OSError:
            pass
        time.sleep(0.05)
    raise AssertionError("not within a minute")


def _is_gone(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().split()[2]
    except FileNotFoundError:
        return True
    return state == "Z"
