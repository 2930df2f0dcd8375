"""Have the jobs of an experiment done, as many at once as there is room for."""

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
from real_bench.experiments.process import JobFailedError, Processes, WorkerLostError

ATTEMPTS = 3
SECONDS_BETWEEN_UPDATES = 0.5


@dataclass(frozen=True)
class Failure:
    """Why a job was not done.

    Attributes:
        detail: in a line.
        kind: the name of the error's class; empty where its process was lost, or where it waited
            for another job.
        seconds: how long it was tried.
    """

    detail: str
    kind: str = ""
    seconds: float = 0.0


OnFailure = Callable[[Job, Failure], None]
"""Told of a failure at once, so that it can be kept before anything else goes wrong."""


class JobRunner(Protocol):
    """Where jobs are done: processes of this machine, or a cluster."""

    def do(self, job: Job, report: OnSteps) -> None:
        """Do a job; its file is there when this returns. Called from many threads.

        Raises:
            JobFailedError: it cannot be done.
            WorkerLostError: whatever did it died.
        """

    def waits_for(self) -> str:
        """What nothing can be done without; empty where nothing is missing.

        Raises:
            ExperimentError: it has waited for too long.
        """

    def stop(self) -> None:
        """End what is being done."""


@dataclass(frozen=True)
class ExperimentProgress:
    """How far the work has come.

    Attributes:
        n_steps: steps of simulation done.
        n_jobs: jobs that have come to an end.
        running: names of those that are being done, and what their controllers are busy with.
        waits_for: what must come before they can be; empty where nothing is missing.
    """

    n_steps: int
    n_jobs: int
    running: tuple[str, ...]
    waits_for: str


OnProgress = Callable[[ExperimentProgress], None]
"""Told from time to time how far jobs have come."""


def _ignored(job: Job, failure: Failure) -> None:
    """Nobody is told."""


class JobScheduler:
    """Does the work of an experiment.

    Args:
        workplace: where.
        n_at_once: how many jobs at once.
    """

    def __init__(self, workplace: JobRunner, n_at_once: int) -> None:
        self._workplace, self._n_at_once = workplace, n_at_once

    def do(
        self,
        work: PendingJobs,
        update: OnProgress,
        on_failure: OnFailure = _ignored,
    ) -> dict[str, Failure]:
        """Do all that can be done.

        Args:
            work: the jobs.
            update: told from time to time how far they have come.
            on_failure: told of each failure.

        Returns:
            Why jobs were not done, by name; a test whose play failed is among them.
        """
        shift = _Shift(work, on_failure)
        with ThreadPoolExecutor(self._n_at_once) as pool:
            try:
                running: dict[Future[None], Job] = {}
                while running or shift.ready:
                    while shift.ready and len(running) < self._n_at_once:
                        job = shift.ready.popleft()
                        running[pool.submit(self._attempt, job, shift.reporter(job))] = job
                    done, _ = wait(running, SECONDS_BETWEEN_UPDATES, FIRST_COMPLETED)
                    for future in done:
                        shift.end(running.pop(future), future.exception())
                    names = [shift.label(job) for job in running.values()]
                    update(shift.progress(names, self._workplace.waits_for() if names else ""))
            except BaseException:
                self._workplace.stop()
                raise
        return shift.failures

    def _attempt(self, job: Job, report: OnSteps) -> None:
        for attempt in range(1, ATTEMPTS + 1):
            try:
                return self._workplace.do(job, report)
            except WorkerLostError:
                if attempt == ATTEMPTS:
                    raise


@dataclass(frozen=True)
class Workplace:
    """Where jobs are to be done: in processes of this machine, or on a cluster.

    Attributes:
        folder: of the results; processes here have their logs in it.
        n_at_once: how many jobs at once; as many as there are cores, or as a cluster takes, where
            None.
        address: of a Dask scheduler; processes of this machine where None.
    """

    folder: Path
    n_at_once: int | None
    address: str | None

    def do(
        self, work: PendingJobs, update: OnProgress, on_failure: OnFailure = _ignored
    ) -> dict[str, Failure]:
        """Do all that can be done; gives why jobs were not, by name.

        Raises:
            Interrupted: the user stopped it.
        """
        try:
            return self._scheduler().do(work, update, on_failure)
        except KeyboardInterrupt as error:
            raise Interrupted(
                "stopped; what is finished is kept: repeat the command to go on"
            ) from error

    def _scheduler(self) -> JobScheduler:
        if self.address is None:
            here = Processes(self.folder / "logs")
            return JobScheduler(here, self.n_at_once or os.cpu_count() or 1)
        from real_bench.experiments.cluster import AT_ONCE, Cluster

        return JobScheduler(Cluster(self.address), self.n_at_once or AT_ONCE)


class _Shift:
    """What is ready to be done, what waits for it, and how far each job has come."""

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
        """What the job, which now begins, is to tell of its steps."""
        self._began[job.name] = time.monotonic()

        def report(done: int, busy: str = "") -> None:
            self._steps[job.name], self._busy[job.name] = done, busy

        return report

    def label(self, job: Job) -> str:
        """A job's name, and what its controller is busy with where it has been for a while."""
        busy = self._busy.get(job.name)
        return f"{job.name} ({busy})" if busy else job.name

    def end(self, job: Job, error: BaseException | None) -> None:
        """A job has come to an end; what waited for it can begin, or never will."""
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

    def progress(self, running: list[str], waits_for: str) -> ExperimentProgress:
        """How far all have come."""
        n_steps = sum(list(self._steps.values()))
        return ExperimentProgress(n_steps, self._n_ended, tuple(running), waits_for)
