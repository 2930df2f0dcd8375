"""Work that is shared among processes, of which none outlives its parent."""

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
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar
from uuid import uuid4

from real_bench.errors import RealBenchError
from real_bench.files import write_whole
from real_bench.finding import controller_folders
from real_bench.locks import own_folder
from real_bench.parent import end_when
from real_bench.phases.stopping import STOP_SIGNALS, StopRequest

MAKE_WORKER = "make_worker"

Item = TypeVar("Item")
Done = TypeVar("Done")


def in_processes(
    make_worker: Callable[[], Callable[[Item], Done]],
    tasks: Iterable[Item],
    jobs: int,
    stop: StopRequest,
    remedy: str,
) -> Iterator[Done]:
    """Do every task in one of several processes; each gives what came of it as it ends.

    After a failure or a request to stop no further task is begun, and those under way come to
    their end. What is told and what comes of it goes through files: a process that dies in the
    middle of much that it reads or writes in a pipe would leave the others waiting for ever.

    Args:
        make_worker: makes, once in each process, what does a task; sent there by pickle.
        tasks: what each is told, sent there by pickle.
        jobs: how many processes.
        stop: the user's request.
        remedy: what the user may do if a process dies.

    Raises:
        RealBenchError: a process died.
        Exception: whatever the first task that failed has raised.
    """
    with own_folder("realbench-work-") as folder, _importing_nothing_from_here():
        write_whole(folder / MAKE_WORKER, pickle.dumps(make_worker))
        spawn = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(jobs, spawn, initializer=_start, initargs=(folder,))
        for done in _done(pool, tasks, jobs, stop, remedy):
            yield pickle.loads(done.read_bytes())
            done.unlink()


@contextmanager
def _importing_nothing_from_here() -> Iterator[None]:
    """Have new processes not begin with what lies in the current folder, or beside a controller.

    Modules there may have the names of ours; a controller is found in its process all the same.
    """
    name = "PYTHONSAFEPATH"  # from Python 3.11 on
    before = os.environ.get(name)
    os.environ[name] = "1"
    path, strange = list(sys.path), controller_folders()
    sys.path[:] = [folder for folder in path if folder not in strange]
    try:
        yield
    finally:
        sys.path[:] = path
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


def _done(
    pool: ProcessPoolExecutor, tasks: Iterable[Any], jobs: int, stop: StopRequest, remedy: str
) -> Iterator[Path]:
    """The file of each result."""
    waiting = iter(tasks)
    failed = None
    try:
        running = _submit(pool, islice(waiting, jobs))
        while running:
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                if future.exception() is None:
                    yield future.result()
                else:
                    failed = future  # what else is under way may still come to its end
            if failed is None and not stop.made:
                running |= _submit(pool, islice(waiting, len(done)))
        if failed is not None:
            failed.result()
    except BrokenProcessPool as error:
        raise RealBenchError(f"a worker process died; {remedy}") from error
    finally:
        pool.shutdown(cancel_futures=True)


def _submit(pool: ProcessPoolExecutor, tasks: Iterable[Any]) -> set[Future[Any]]:
    """Have tasks done; workers are started with the signals to stop held back.

    A worker that is interrupted before it has begun would leave the pool hanging.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)
    try:
        return {pool.submit(_do, task) for task in tasks}
    except OSError as error:  # it died while it was being started
        raise BrokenProcessPool from error
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)


class _Here:
    """What a worker process keeps between tasks; a process has no other place for it."""

    folder: Path
    worker: Callable[[Any], Any] | None = None


def _start(folder: Path) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides when to stop
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)
    sys.stdout = sys.stderr  # what a controller prints is no result
    logging.basicConfig(format="%(message)s")
    logging.getLogger("real_bench").setLevel(logging.INFO)
    if (parent := multiprocessing.parent_process()) is not None:
        end_when(parent.join)
    _Here.folder = folder


def _do(task: Any) -> Path:
    if _Here.worker is None:  # made here and not at the start, so that its errors are reported
        _Here.worker = pickle.loads((_Here.folder / MAKE_WORKER).read_bytes())()
    done = _Here.folder / uuid4().hex
    write_whole(done, pickle.dumps(_Here.worker(task)))
    return done
