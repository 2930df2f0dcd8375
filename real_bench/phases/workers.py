"""Work shared among processes, none of which outlives its parent."""

from __future__ import annotations

import logging
import multiprocessing
import os
import pickle
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, nullcontext
from itertools import islice
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar
from uuid import uuid4

from real_bench.controller_code.finding import controller_folders
from real_bench.errors import RealBenchError
from real_bench.files.atomic import write_atomically
from real_bench.files.locks import temporary_folder
from real_bench.parent import exit_after
from real_bench.phases.activity import LEARNING, Activity, ignore_activity
from real_bench.phases.stopping import STOP_SIGNALS, StopRequest

MAKE_WORKER = "make_worker"
STARTING = "making-"
"""Stem of the file that exists while a process makes its worker."""
POLL_INTERVAL_S = 0.5

Item = TypeVar("Item")
Done = TypeVar("Done")


def in_processes(
    make_worker: Callable[[], Callable[[Item], Done]],
    tasks: Iterable[Item],
    jobs: int,
    stop: StopRequest,
    remedy: str,
    activity: Activity = ignore_activity,
) -> Iterator[Done]:
    """Do every task in one of several processes; yields each outcome as its task ends.

    After a failure or a request to stop no further task begins, and running ones finish. Tasks and
    outcomes go through files: a process that dies while it reads or writes a large message in a
    pipe would leave the others waiting forever.

    Args:
        make_worker: makes, once in each process, what does a task; sent there by pickle.
        tasks: what each worker is given, sent there by pickle.
        jobs: how many processes.
        stop: the user's request.
        remedy: what the user may do if a process dies.
        activity: called while workers are made: a controller learns then.

    Raises:
        RealBenchError: a process died.
        Exception: whatever the first task that failed has raised.
    """
    with temporary_folder("realbench-work-") as folder, _without_local_imports():
        write_atomically(folder / MAKE_WORKER, pickle.dumps(make_worker))
        spawn = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(jobs, spawn, initializer=_init_worker, initargs=(folder,))
        for done in _result_files(
            pool, tasks, jobs, stop, remedy, _StartupMonitor(folder, activity)
        ):
            yield pickle.loads(done.read_bytes())
            done.unlink()


@contextmanager
def _without_local_imports() -> Iterator[None]:
    """Keep new processes from importing from the current folder or a controller's folder.

    Modules there may have the names of ours; a process finds its controller anyway.
    """
    name = "PYTHONSAFEPATH"  # Python 3.11 or newer
    before = os.environ.get(name)
    os.environ[name] = "1"
    path, controller_paths = list(sys.path), controller_folders()
    sys.path[:] = [folder for folder in path if folder not in controller_paths]
    try:
        yield
    finally:
        sys.path[:] = path
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


@contextmanager
def _without_main() -> Iterator[None]:
    """Keep processes that start now from running the user's script, of which they need nothing.

    Otherwise a script that tests with several jobs, and has no ``if __name__ == "__main__"``,
    would begin again in each of them.
    """
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


class _StartupMonitor:
    """Reports whether a process is still making its worker."""

    def __init__(self, folder: Path, activity: Activity) -> None:
        self._folder, self._activity = folder, activity

    def wait(self, running: set[Future[Any]]) -> tuple[set[Future[Any]], set[Future[Any]]]:
        """The tasks that have ended, once one has, and those under way."""
        done: set[Future[Any]] = set()
        while not done:
            starting = self._is_starting
            with self._activity(LEARNING) if starting else nullcontext():
                while not done and self._is_starting == starting:
                    done, running = wait(running, POLL_INTERVAL_S, FIRST_COMPLETED)
        return done, running

    @property
    def _is_starting(self) -> bool:
        return any(self._folder.glob(f"{STARTING}*"))


def _result_files(
    pool: ProcessPoolExecutor,
    tasks: Iterable[Any],
    jobs: int,
    stop: StopRequest,
    remedy: str,
    monitor: _StartupMonitor,
) -> Iterator[Path]:
    """The file of each result."""
    waiting = iter(tasks)
    failed = None
    try:
        running = _submit(pool, islice(waiting, jobs))
        while running:
            done, running = monitor.wait(running)
            for future in done:
                if future.exception() is None:
                    yield future.result()
                else:
                    failed = future  # let other running tasks finish
            if failed is None and not stop.requested:
                running |= _submit(pool, islice(waiting, len(done)))
        if failed is not None:
            failed.result()
    except BrokenProcessPool as error:
        raise RealBenchError(f"a worker process died; {remedy}") from error
    finally:
        pool.shutdown(cancel_futures=True)


def _submit(pool: ProcessPoolExecutor, tasks: Iterable[Any]) -> set[Future[Any]]:
    """Submit tasks; workers are started with stop signals blocked.

    A worker that is interrupted before it has begun would leave the pool hanging.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)
    try:
        with _without_main():
            return {pool.submit(_run_task, task) for task in tasks}
    except OSError as error:  # it died while it was being started
        raise BrokenProcessPool from error
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)


class _WorkerState:
    """What a worker process keeps between tasks; a process has no other place for it."""

    folder: Path
    worker: Callable[[Any], Any] | None = None


def _init_worker(folder: Path) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides when to stop
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)
    sys.stdout = sys.stderr  # stdout is for results
    logging.basicConfig(format="%(message)s")
    logging.getLogger("real_bench").setLevel(logging.INFO)
    if (parent := multiprocessing.parent_process()) is not None:
        exit_after(parent.join)
    _WorkerState.folder = folder


def _run_task(task: Any) -> Path:
    if _WorkerState.worker is None:  # made here, not at the start, so that its errors are reported
        starting = _WorkerState.folder / f"{STARTING}{os.getpid()}"
        starting.touch()
        try:
            _WorkerState.worker = pickle.loads((_WorkerState.folder / MAKE_WORKER).read_bytes())()
        finally:
            starting.unlink()
    done = _WorkerState.folder / uuid4().hex
    write_atomically(done, pickle.dumps(_WorkerState.worker(task)))
    return done
