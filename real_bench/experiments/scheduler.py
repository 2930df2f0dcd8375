"""Run the jobs of an experiment, several at once."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from real_bench.errors import Interrupted
from real_bench.experiments.jobs import Job, OnSteps
from real_bench.experiments.plan import PendingJobs
from real_bench.experiments.process import (
    JobFailedError,
    JobStoppedError,
    Processes,
    WorkerLostError,
)

ATTEMPTS = 3
SECONDS_BETWEEN_UPDATES = 0.5


@dataclass(frozen=True)
class Failure:
    """Why a job failed.

    Attributes:
        detail: in a line.
        kind: the name of the error's class; empty if its process was lost, or if it waited for
            another job.
        seconds: how long it ran.
    """

    detail: str
    kind: str = ""
    seconds: float = 0.0


OnFailure = Callable[[Job, Failure], None]
"""Called at once on a failure, so that it is kept before anything else goes wrong."""


class JobRunner(Protocol):
    """Where jobs run: processes of this machine, or a cluster."""

    def do(self, job: Job, report: OnSteps) -> None:
        """Do a job; its file is there when this returns. Called from many threads.

        Raises:
            JobFailedError: it cannot be done.
            WorkerLostError: its worker died.
        """

    def waiting_for(self) -> str:
        """What all jobs are waiting for; empty if nothing is missing.

        Raises:
            ExperimentError: the wait is too long.
        """

    def stop(self) -> None:
        """Stop running jobs, if there are any, and leave."""


@dataclass(frozen=True)
class ExperimentProgress:
    """The progress of the work.

    Attributes:
        n_steps: steps of simulation done.
        n_jobs: jobs that have ended.
        running: names of running jobs, and what their controllers are busy with.
        waiting_for: what they are waiting for; empty if nothing is missing.
    """

    n_steps: int
    n_jobs: int
    running: tuple[str, ...]
    waiting_for: str


OnProgress = Callable[[ExperimentProgress], None]
"""Called from time to time with the progress of jobs."""


def _ignore(job: Job, failure: Failure) -> None:
    """Do nothing."""


class JobScheduler:
    """Runs the jobs of an experiment.

    Args:
        runner: where they run.
        n_at_once: how many jobs at once.
    """

    def __init__(self, runner: JobRunner, n_at_once: int) -> None:
        self._runner, self._n_at_once = runner, n_at_once

    def do(
        self,
        work: PendingJobs,
        update: OnProgress,
        on_failure: OnFailure = _ignore,
    ) -> dict[str, Failure]:
        """Run all jobs that can run.

        Args:
            work: the jobs.
            update: called from time to time with their progress.
            on_failure: called with each failure.

        Returns:
            Why jobs failed, by name, including tests whose play failed.

        Raises:
            Interrupted: the user stopped it.
        """
        queue = _JobQueue(work, on_failure)
        try:
            self._run(queue, update)
        except KeyboardInterrupt as error:
            raise Interrupted(
                "stopped; finished jobs are kept: repeat the command to continue"
            ) from error
        return queue.failures

    def _run(self, queue: _JobQueue, update: OnProgress) -> None:
        with ThreadPoolExecutor(self._n_at_once) as pool:
            try:
                running: dict[Future[None], Job] = {}
                while running or queue.ready:
                    while queue.ready and len(running) < self._n_at_once:
                        job = queue.ready.popleft()
                        running[pool.submit(self._attempt, job, queue.reporter(job))] = job
                    done, _ = wait(running, SECONDS_BETWEEN_UPDATES, FIRST_COMPLETED)
                    for future in done:
                        queue.end(running.pop(future), future.exception())
                    names = [queue.label(job) for job in running.values()]
                    update(queue.progress(names, self._runner.waiting_for() if names else ""))
            finally:
                self._runner.stop()

    def _attempt(self, job: Job, report: OnSteps) -> None:
        for attempt in range(1, ATTEMPTS + 1):
            try:
                return self._runner.do(job, report)
            except (JobStoppedError, WorkerLostError):
                if attempt == ATTEMPTS:
                    raise


def job_scheduler(folder: Path, n_at_once: int | None, address: str | None) -> JobScheduler:
    """Runs jobs in processes of this machine, or on a cluster.

    Args:
        folder: of the results; processes here have their logs in it.
        n_at_once: how many jobs at once; None: one per core, or as many as a cluster takes.
        address: of a Dask scheduler; None: processes of this machine.
    """
    if address is None:
        return JobScheduler(Processes(folder / "logs"), n_at_once or os.cpu_count() or 1)
    from real_bench.experiments.cluster import AT_ONCE, Cluster

    return JobScheduler(Cluster(address), n_at_once or AT_ONCE)


class _JobQueue:
    """Which jobs are ready, which wait for them, and the progress of each."""

    def __init__(self, work: PendingJobs, on_failure: OnFailure) -> None:
        self._on_failure = on_failure
        self._began: dict[str, float] = {}
        to_play = {job.name for job in work.plays}
        free = [job for job in work.scorings if job.play not in to_play]
        self.ready: deque[Job] = deque([*work.plays, *free])
        self._waiting = [job for job in work.scorings if job.play in to_play]
        self._steps: dict[str, int] = {}
        self._busy: dict[str, str] = {}
        self._n_ended = 0
        self.failures: dict[str, Failure] = {}

    def reporter(self, job: Job) -> OnSteps:
        """The function by which a job that begins reports its steps."""
        self._began[job.name] = time.monotonic()

        def report(done: int, busy: str = "") -> None:
            self._steps[job.name], self._busy[job.name] = done, busy

        return report

    def label(self, job: Job) -> str:
        """A job's name, and what its controller has been busy with for a while."""
        busy = self._busy.get(job.name)
        return f"{job.name} ({busy})" if busy else job.name

    def end(self, job: Job, error: BaseException | None) -> None:
        """A job has ended; what waited for it can begin, or never will."""
        self._n_ended += 1
        self._steps[job.name] = job.n_steps
        followers = [each for each in self._waiting if each.play == job.name]
        self._waiting = [each for each in self._waiting if each.play != job.name]
        if error is None:
            self.ready.extendleft(reversed(followers))
            return
        if not isinstance(error, JobFailedError | WorkerLostError):
            raise error
        kind = error.kind if isinstance(error, JobFailedError) else ""
        seconds = time.monotonic() - self._began[job.name]
        self._fail(job, Failure(str(error), kind, seconds))
        for follower in followers:
            self._n_ended += 1
            self._fail(follower, Failure(f"{follower.name}: {job.name} failed"))

    def _fail(self, job: Job, failure: Failure) -> None:
        self.failures[job.name] = failure
        self._on_failure(job, failure)

    def progress(self, running: list[str], waiting_for: str) -> ExperimentProgress:
        """The progress of all jobs."""
        n_steps = sum(list(self._steps.values()))
        return ExperimentProgress(n_steps, self._n_ended, tuple(running), waiting_for)
