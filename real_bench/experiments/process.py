"""Do a job in a process of its own, so that only the job dies with it."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import AbstractContextManager, nullcontext, suppress
from pathlib import Path
from typing import IO, Any

from real_bench.errors import (
    ControllerStoppedError,
    ExperimentError,
    Interrupted,
    RealBenchError,
)
from real_bench.experiments.jobs import CheckJob, Job, OnSteps
from real_bench.text.signal_names import signal_name

WORKER = "import sys; del sys.path[0]; from real_bench.experiments.worker import main; main()"
"""Does not import from the current folder, which may be a stranger's."""


class JobFailedError(RealBenchError):
    """A job cannot be done; trying again would not help.

    Args:
        detail: why.
        kind: the name of the error's class.
    """

    def __init__(self, detail: str, kind: str = "") -> None:
        super().__init__(detail, kind)  # both, so that it survives the way from a cluster's worker
        self.kind = kind

    def __str__(self) -> str:
        return str(self.args[0])


class JobStoppedError(JobFailedError):
    """A job's controller was stopped, perhaps by whoever stops its worker: it may be tried again.

    It must not be tried forever, since a controller can stop itself.
    """


class WorkerLostError(RealBenchError):
    """The worker of a job died, or was stopped; another one may do it."""


class Processes:
    """Processes of this machine, one per job.

    Args:
        logs: folder for what jobs print; None: they print to our own output.
    """

    def __init__(self, logs: Path | None = None) -> None:
        self._logs = logs
        self._running: set[subprocess.Popen[str]] = set()
        self._stopped = False

    def do(self, job: Job | CheckJob, report: OnSteps) -> None:
        """Do a job; returns when its file is there, or the check has passed.

        Raises:
            JobFailedError: it cannot be done, and why.
            WorkerLostError: its process died, or was stopped.
        """
        if self._stopped:
            raise WorkerLostError(f"{job.name} was not started")
        with self._log(job) as log, self._process(log) as process:
            self._running.add(process)
            if self._stopped:  # meanwhile
                process.kill()
            try:
                ended = self._follow(process, job, report)
            finally:
                self._running.discard(process)
                process.kill()
        if "failed" in ended:
            raise _failure(f"{job.name}: {ended['failed']}", ended["kind"])
        if "finished" not in ended:
            raise WorkerLostError(f"{job.name}: its process died ({_cause(process.returncode)})")

    def waiting_for(self) -> str:
        """Nothing: a process can always be started."""
        return ""

    def stop(self) -> None:
        """Kill all of them; what they wrote stays whole."""
        self._stopped = True
        for process in list(self._running):
            process.kill()

    @staticmethod
    def _follow(
        process: subprocess.Popen[str], job: Job | CheckJob, report: OnSteps
    ) -> dict[str, Any]:
        """Listen to the end; returns the last message."""
        assert process.stdin is not None
        assert process.stdout is not None
        message: dict[str, Any] = {}
        try:
            process.stdin.write(job.model_dump_json() + "\n")
            process.stdin.flush()
            for line in process.stdout:
                message = json.loads(line)
                if "done" in message:
                    report(message["done"], message.get("busy", ""))
        except (BrokenPipeError, ValueError):  # it died in the middle of a message
            message = {}
        with suppress(BrokenPipeError):  # about what it had not read yet
            process.stdin.close()
        process.wait()
        return message

    @staticmethod
    def _process(log: IO[bytes] | None) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-c", WORKER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            start_new_session=True,  # Ctrl-C is for us; they end with us
        )

    def _log(self, job: Job | CheckJob) -> AbstractContextManager[IO[bytes] | None]:
        if self._logs is None:
            return nullcontext()
        try:
            self._logs.mkdir(parents=True, exist_ok=True)
            return (self._logs / f"{job.name}.log").open("ab")
        except OSError as error:
            raise ExperimentError(f"cannot write into {self._logs}: {error.strerror}") from error


def _failure(detail: str, kind: str) -> JobFailedError | WorkerLostError:
    if kind == Interrupted.__name__:
        return WorkerLostError(detail)
    if kind == ControllerStoppedError.__name__:
        return JobStoppedError(detail, kind)
    return JobFailedError(detail, kind)


def _cause(code: int) -> str:
    return signal_name(-code) if code < 0 else f"exit code {code}"
