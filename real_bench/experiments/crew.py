"""Have the tasks of an experiment done, as many at once as there is room for."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Protocol

from real_bench.experiments.agenda import Work
from real_bench.experiments.process import TaskFailedError, WorkerLostError
from real_bench.experiments.tasks import Report, Task

ATTEMPTS = 3
SECONDS_BETWEEN_UPDATES = 0.5


class Workplace(Protocol):
    """Where tasks are done: processes of this machine, or a cluster."""

    def do(self, task: Task, report: Report) -> None:
        """Do a task; its file is there when this returns. Called from many threads.

        Raises:
            TaskFailedError: it cannot be done.
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
class Standing:
    """How far the work has come.

    Attributes:
        n_steps: steps of simulation done.
        n_tasks: tasks that have come to an end.
        running: names of those that are being done.
        waits_for: what must come before they can be; empty where nothing is missing.
    """

    n_steps: int
    n_tasks: int
    running: tuple[str, ...]
    waits_for: str


class Crew:
    """Does the work of an experiment.

    Args:
        workplace: where.
        jobs: how many tasks at once.
    """

    def __init__(self, workplace: Workplace, jobs: int) -> None:
        self._workplace, self._jobs = workplace, jobs

    def do(self, work: Work, update: Callable[[Standing], None]) -> dict[str, str]:
        """Do all that can be done.

        Args:
            work: the tasks.
            update: told from time to time how far they have come.

        Returns:
            Why tasks were not done, by name; a test whose play failed is among them.
        """
        shift = _Shift(work)
        with ThreadPoolExecutor(self._jobs) as pool:
            try:
                running: dict[Future[None], Task] = {}
                while running or shift.ready:
                    while shift.ready and len(running) < self._jobs:
                        task = shift.ready.popleft()
                        running[pool.submit(self._attempt, task, shift.reporter(task))] = task
                    done, _ = wait(running, SECONDS_BETWEEN_UPDATES, FIRST_COMPLETED)
                    for future in done:
                        shift.end(running.pop(future), future.exception())
                    names = [task.name for task in running.values()]
                    update(shift.standing(names, self._workplace.waits_for() if names else ""))
            except BaseException:
                self._workplace.stop()
                raise
        return shift.failures

    def _attempt(self, task: Task, report: Report) -> None:
        for attempt in range(1, ATTEMPTS + 1):
            try:
                return self._workplace.do(task, report)
            except WorkerLostError:
                if attempt == ATTEMPTS:
                    raise


class _Shift:
    """What is ready to be done, what waits for it, and how far each task has come."""

    def __init__(self, work: Work) -> None:
        to_play = {task.name for task in work.plays}
        free = [task for task in work.scorings if task.play not in to_play]
        self.ready: deque[Task] = deque([*work.plays, *free])
        self._waiting = [task for task in work.scorings if task.play in to_play]
        self._steps: dict[str, int] = {}
        self._n_ended = 0
        self.failures: dict[str, str] = {}

    def reporter(self, task: Task) -> Report:
        """What the task is to tell of its steps."""

        def report(done: int) -> None:
            self._steps[task.name] = done

        return report

    def end(self, task: Task, error: BaseException | None) -> None:
        """A task has come to an end; what waited for it can begin, or never will."""
        self._n_ended += 1
        self._steps[task.name] = task.n_steps
        followers = [each for each in self._waiting if each.play == task.name]
        self._waiting = [each for each in self._waiting if each.play != task.name]
        if error is None:
            self.ready.extendleft(reversed(followers))
            return
        if not isinstance(error, TaskFailedError | WorkerLostError):
            raise error
        self.failures[task.name] = str(error)
        for follower in followers:
            self._n_ended += 1
            self.failures[follower.name] = f"{follower.name}: {task.name} failed"

    def standing(self, running: list[str], waits_for: str) -> Standing:
        """How far all have come."""
        n_steps = sum(list(self._steps.values()))
        return Standing(n_steps, self._n_ended, tuple(running), waits_for)
