from __future__ import annotations

import threading
from collections import Counter
from pathlib import Path
from unittest.mock import ANY

import pytest

from real_bench.errors import Interrupted
from real_bench.experiments import Spec
from real_bench.experiments.jobs import Job, OnSteps
from real_bench.experiments.plan import ExperimentPlan, PendingJobs
from real_bench.experiments.process import JobFailedError, JobStoppedError, WorkerLostError
from real_bench.experiments.scheduler import ATTEMPTS, ExperimentProgress, Failure, JobScheduler


class Rehearsal:
    """A workplace where nothing is done but what the test says.

    A fake, for workers that die at a chosen moment cannot be had otherwise.
    """

    def __init__(self, failing: dict[str, list[Exception]] | None = None) -> None:
        self.failing = failing or {}
        self.done: list[str] = []
        self.calls: Counter[str] = Counter()
        self.stopped = False
        self._lock = threading.Lock()

    def do(self, job: Job, report: OnSteps) -> None:
        with self._lock:
            self.calls[job.name] += 1
            errors = self.failing.get(job.name, [])
            if errors:
                raise errors.pop(0)
            report(job.n_steps // 2)
            self.done.append(job.name)

    def waiting_for(self) -> str:
        return ""

    def stop(self) -> None:
        self.stopped = True


@pytest.fixture
def work(spec: Spec) -> PendingJobs:
    return ExperimentPlan(spec).pending()


def lost() -> WorkerLostError:
    return WorkerLostError("gone")


@pytest.mark.parametrize("jobs", [1, 3, 50])
def test_every_job_is_done_once_and_tests_follow_their_play(work: PendingJobs, jobs: int) -> None:
    place = Rehearsal()
    standings: list[ExperimentProgress] = []
    assert JobScheduler(place, jobs).do(work, standings.append) == {}
    assert place.stopped  # or a client of a cluster stays open
    names = [job.name for job in (*work.plays, *work.scorings)]
    assert sorted(place.done) == sorted(names)
    for job in work.scorings:
        if job.play:
            assert place.done.index(job.play) < place.done.index(job.name)
    assert standings[-1] == ExperimentProgress(work.n_steps, len(names), (), "")


def test_job_whose_worker_dies_is_retried(work: PendingJobs) -> None:
    name = work.plays[0].name
    place = Rehearsal({name: [lost()] * (ATTEMPTS - 1)})
    assert JobScheduler(place, 2).do(work, lambda progress: None) == {}
    assert place.calls[name] == ATTEMPTS
    assert len(place.done) == len(work)


@pytest.mark.parametrize(("error", "kind"), [(lost(), ""), (JobStoppedError("gone", "K"), "K")])
def test_job_that_ends_every_worker_is_given_up(
    work: PendingJobs, error: Exception, kind: str
) -> None:
    name = work.scorings[0].name
    place = Rehearsal({name: [error] * ATTEMPTS})
    assert JobScheduler(place, 2).do(work, lambda progress: None) == {
        name: Failure("gone", kind, seconds=ANY)
    }
    assert place.calls[name] == ATTEMPTS
    assert len(place.done) == len(work) - 1


def test_failed_play_fails_only_its_own_tests(
    work: PendingJobs,
) -> None:
    name = work.plays[0].name
    place = Rehearsal({name: [JobFailedError("broken")]})
    standings: list[ExperimentProgress] = []
    failures = JobScheduler(place, 2).do(work, standings.append)
    followers = {job.name for job in work.scorings if job.play == name}
    assert followers
    assert set(failures) == {name, *followers}
    assert place.calls[name] == 1
    assert len(place.done) == len(work) - len(failures)
    assert standings[-1].n_jobs == len(work)


def test_internal_error_stops_everything(work: PendingJobs) -> None:
    place = Rehearsal({work.plays[0].name: [ZeroDivisionError()]})
    with pytest.raises(ZeroDivisionError):
        JobScheduler(place, 2).do(work, lambda progress: None)
    assert place.stopped


def test_an_interrupt_stops_everything(work: PendingJobs) -> None:
    place = Rehearsal()

    def interrupt(progress: ExperimentProgress) -> None:
        raise KeyboardInterrupt

    with pytest.raises(Interrupted, match="finished jobs are kept"):
        JobScheduler(place, 1).do(work, interrupt)
    assert place.stopped


def test_plays_shared_by_cells_are_made_once(work: PendingJobs, tmp_path: Path) -> None:
    assert [job.name for job in work.plays] == ["random-1-seed0", "random-1-seed1"]
    assert len(work.scorings) == 5
    assert work.scorings[0].run == work.scorings[2].run == tmp_path / "results/random-1-seed0.h5"
    assert work.scorings[4].run is None
    assert work.n_steps == 2 * 2000 + 5 * 2 * 500
