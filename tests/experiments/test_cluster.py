from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from real_bench.errors import ExperimentError
from real_bench.experiments import Spec
from real_bench.experiments import cluster as clusters
from real_bench.experiments.plan import ExperimentPlan
from real_bench.experiments.scheduler import ExperimentProgress, JobScheduler
from tests.cli.shell import COMMAND, heed_ctrl_c
from tests.experiments.conftest import Finished, WriteSpec

if find_spec("distributed") is None:  # a worker that runs none of these need not import it
    pytest.skip("the extra real-bench[cluster] is not installed", allow_module_level=True)
SECONDS = 120


class DaskCluster:
    """A real scheduler and real workers, each a process of its own."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self._folder, self._stack = folder, stack
        log = folder / "scheduler.log"
        self._start(["scheduler", "--host", "127.0.0.1", "--port", "0"], log)
        self.address = self._told(log, r"Scheduler at:\s+(tcp://\S+)")
        self.workers: list[subprocess.Popen[bytes]] = []

    def add_workers(self, n: int, **environment: str) -> None:
        logs = [self._folder / f"worker-{number}.log" for number in range(n)]
        options = ["--nthreads", "1", "--no-nanny", "--local-directory", str(self._folder)]
        for log in logs:
            command = ["worker", self.address, *options]
            self.workers.append(self._start(command, log, **environment))
        for log in logs:
            self._told(log, r"Registered to:\s+(\S+)")

    def busy_workers(self) -> list[subprocess.Popen[bytes]]:
        """Those that do a job now, in a process of its own."""
        return [worker for worker in self.workers if _children(worker.pid)]

    def _start(
        self, arguments: list[str], log: Path, **environment: str
    ) -> subprocess.Popen[bytes]:
        dask = Path(sys.executable).with_name("dask")
        command = [str(dask), *arguments, "--dashboard-address", "127.0.0.1:0"]
        with log.open("wb") as file:
            process = subprocess.Popen(
                command, stdout=file, stderr=file, env={**os.environ, **environment}
            )
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process

    @staticmethod
    def _told(log: Path, pattern: str) -> str:
        end = time.monotonic() + SECONDS
        while time.monotonic() < end:
            if found := re.search(pattern, log.read_text()):
                return found[1]
            time.sleep(0.1)
        raise AssertionError(log.read_text())


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[DaskCluster]:
    with ExitStack() as stack:
        yield DaskCluster(tmp_path, stack)


@pytest.fixture(scope="module")
def two_workers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DaskCluster]:
    """A cluster of two workers, of which a test may kill one."""
    with ExitStack() as stack:
        cluster = DaskCluster(tmp_path_factory.mktemp("cluster"), stack)
        cluster.add_workers(2)
        yield cluster


def test_ctrl_c_leaves_no_process_on_the_cluster(
    two_workers: DaskCluster, write_spec: WriteSpec
) -> None:
    path = write_spec(steps=100_000_000)
    process = subprocess.Popen(
        [str(COMMAND), "table", str(path), "--scheduler", two_workers.address],
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heed_ctrl_c,
    )
    _until(two_workers.busy_workers)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=SECONDS)
    assert process.returncode == 130, told
    assert "repeat the command to continue" in told
    _until(lambda: not two_workers.busy_workers())


def test_killed_worker_does_not_change_the_results(
    two_workers: DaskCluster, finished: Finished, write_spec: WriteSpec, tmp_path: Path
) -> None:
    command = [str(COMMAND), "table", str(write_spec()), "--json"]
    process = subprocess.Popen(
        [*command, "--scheduler", two_workers.address],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    (victim, *_) = _until(two_workers.busy_workers)
    os.kill(victim.pid, signal.SIGKILL)
    there, told = process.communicate(timeout=300)
    assert process.returncode == 0, told
    assert json.loads(there) == finished.table
    # results come back whole, and nothing else is left in the folder
    names = {path.name for path in (tmp_path / "results").iterdir()}
    assert {name for name in names if name.endswith(".h5")} == {
        "random-1-seed0.h5",
        "random-1-seed1.h5",
    }
    assert not {name for name in names if name.startswith(".")}


def _until(ask: Callable[[], Any]) -> Any:
    """Wait until something is so, for a generous while; gives the answer."""
    end = time.monotonic() + SECONDS
    while not (answer := ask()):
        assert time.monotonic() < end
        time.sleep(0.02)
    return answer


def _children(pid: int) -> list[int]:
    """The processes in which a worker does its jobs."""
    listed = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for file in listed for child in file.read_text().split()]


def test_worker_that_cannot_do_jobs_ends_no_other_job(
    cluster: DaskCluster, drawn: Spec, tmp_path: Path
) -> None:
    """It has no room for temporary files."""
    no_room = f"import tempfile\ntempfile.tempdir = {str(tmp_path / 'nowhere')!r}"
    (tmp_path / "sitecustomize.py").write_text(no_room)
    cluster.add_workers(1, PYTHONPATH=str(tmp_path))
    work = ExperimentPlan(drawn).pending()
    failures = JobScheduler(clusters.Cluster(cluster.address), 2).do(work, lambda progress: None)
    assert set(failures) == {job.name for job in (*work.plays, *work.scorings)}
    assert failures[work.plays[0].name].kind == "OutputError"


def test_cluster_without_workers_is_given_up_with_an_error(
    cluster: DaskCluster, spec: Spec, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clusters, "SECONDS_WITHOUT_WORKERS", 3)
    told: list[ExperimentProgress] = []
    with pytest.raises(ExperimentError, match=f"no worker for 3 s: .*{cluster.address}"):
        JobScheduler(clusters.Cluster(cluster.address), 2).do(
            ExperimentPlan(spec).pending(), told.append
        )
    assert told[0].waiting_for == f"a worker (dask worker {cluster.address})"
    assert told[0].n_jobs == 0
