"""Run jobs on a Dask cluster; files travel with them, so no shared folder is needed."""

from __future__ import annotations

import time
import uuid
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any

from real_bench.errors import ExperimentError
from real_bench.experiments.jobs import CheckJob, Job, OnSteps, job_from_json
from real_bench.experiments.process import JobFailedError, Processes, WorkerLostError
from real_bench.extras import extra
from real_bench.files.atomic import write_atomically
from real_bench.files.locks import temporary_folder
from real_bench.text.quoting import one_line

SECONDS_TO_CONNECT = 10
SECONDS_WITHOUT_WORKERS = 600
AT_ONCE = 64
"""Jobs given to the scheduler at a time; it passes them on as workers come and go."""


class JobCancelledError(Exception):
    """The client that asked for a job is gone."""


class Cluster:
    """A Dask cluster; its workers need realbench, and the files of controllers, installed.

    Args:
        address: of the scheduler, e.g. ``tcp://10.0.0.1:8786``.

    Raises:
        MissingExtraError: dask.distributed is not installed.
        ExperimentError: no scheduler answers.
    """

    def __init__(self, address: str) -> None:
        distributed = extra("distributed", "cluster")
        try:
            self._client = distributed.Client(address, timeout=SECONDS_TO_CONNECT)
        except (OSError, ValueError, TypeError) as error:
            raise ExperimentError(f"no Dask scheduler answers at {address}: {error}") from error
        self._address, self._last_seen = address, time.monotonic()
        self._topic = f"realbench-{uuid.uuid4().hex}"
        self._reports: dict[str, OnSteps] = {}
        self._client.subscribe_topic(self._topic, self._on_event)

    @property
    def n_workers(self) -> int:
        """How many workers there are now; 0 if the scheduler does not answer."""
        try:
            return len(self._client.nthreads())
        except OSError:
            return 0

    def waiting_for(self) -> str:
        """A worker, while there is none.

        Raises:
            ExperimentError: there has been none for ten minutes.
        """
        now = time.monotonic()
        if self.n_workers:
            self._last_seen = now
            return ""
        start = f"dask worker {self._address}"
        if now - self._last_seen > SECONDS_WITHOUT_WORKERS:
            raise ExperimentError(
                f"no worker for {SECONDS_WITHOUT_WORKERS:,} s: start some ({start}) and repeat the "
                "command; finished jobs are kept"
            )
        return f"a worker ({start})"

    def do(self, job: Job, report: OnSteps) -> None:
        """Let a worker do a job, and write what comes back.

        If its worker dies another one does the job; the scheduler gives up after several.

        Raises:
            JobFailedError: it cannot be done, or its worker cannot do jobs, and why.
            WorkerLostError: too many workers died from it.
        """
        self._reports[job.name] = report
        try:
            content = self._done_by_worker(job)
        finally:
            del self._reports[job.name]
        write_atomically(job.out, content)

    def _done_by_worker(self, job: Job) -> bytes:
        """The content of a job's file."""
        from distributed import KilledWorker

        future = self._submit(job)
        try:
            content: bytes = future.result()
        except (JobFailedError, WorkerLostError):
            raise
        except (KilledWorker, CancelledError) as error:
            raise WorkerLostError(f"{job.name}: its worker died ({error})") from error
        except Exception as error:  # no room, another realbench or none: only this job's affair
            kind, why = type(error).__name__, one_line(error)
            text = f"{job.name}: its worker cannot do it ({kind}: {why})"
            raise JobFailedError(text, kind) from error
        return content

    def _submit(self, job: Job) -> Any:
        """Send a job with its files, which are not kept here while it is done."""
        contents = {field: path.read_bytes() for field, path in job.inputs.items()}
        return self._client.submit(
            _on_worker, job.model_dump_json(), contents, self._topic, pure=False
        )

    def stop(self) -> None:
        """Cancel what is not done yet, and leave."""
        self._client.close()

    def _on_event(self, event: tuple[float, Any]) -> None:
        _, message = event
        report = self._reports.get(message["job"])
        if report is not None:
            report(message["done"], message.get("busy", ""))


def _on_worker(text: str, contents: dict[str, bytes], topic: str) -> bytes:
    """Do a job in a folder of its own; gives the file's content."""
    from distributed import get_worker

    worker = get_worker()
    key = worker.get_current_task()
    sent = _job(text)
    with temporary_folder("realbench-job-") as folder:
        job = _relocate(sent, contents, folder)

        def report(done: int, busy: str = "") -> None:
            known = worker.state.tasks.get(key)
            if known is None or known.state == "cancelled":
                raise JobCancelledError
            worker.log_event(topic, {"job": sent.name, "done": done, "busy": busy})

        Processes().do(job, report)
        return job.out.read_bytes()


def _relocate(job: Job, contents: dict[str, bytes], folder: Path) -> Job:
    """The same job with its files in another folder, where they are written."""
    places = {field: folder / f"{field}{job.inputs[field].suffix}" for field in contents}
    for field, content in contents.items():
        places[field].write_bytes(content)
    return job.model_copy(update={**places, "out": folder / job.out.name})


def _job(text: str) -> Job:
    job = job_from_json(text)
    assert not isinstance(job, CheckJob)  # checks run on the user's machine
    return job
