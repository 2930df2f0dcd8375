"""An experiment from its file to its rows: checked first, then what is missing is run."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator
from dataclasses import dataclass

from real_bench.controller_code.source import ControllerSource
from real_bench.errors import ExperimentError
from real_bench.experiments.plan import ExperimentPlan, PendingJobs
from real_bench.experiments.process import JobFailedError, Processes, WorkerLostError
from real_bench.experiments.scheduler import Failure, OnProgress, job_scheduler
from real_bench.experiments.scores import Row, rows_of
from real_bench.experiments.spec import Spec
from real_bench.files.locks import write_lock
from real_bench.files.outputs import check_folder
from real_bench.goal_sets import load_goal_set
from real_bench.sandbox.limits import Limits
from real_bench.simulation import load_scene
from real_bench.text.counting import counted

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Experiment:
    """An experiment to be run.

    Attributes:
        spec: what it is.
        n_at_once: how many jobs at once; None: one per core.
        scheduler: the address of a Dask scheduler; None: processes of this machine.
        isolate: whether controllers are isolated.
        limits: what an isolated controller may use up.
    """

    spec: Spec
    n_at_once: int | None = None
    scheduler: str | None = None
    isolate: bool = False
    limits: Limits | None = None

    def prepare(self, *, overwrite: bool = False) -> None:
        """Draw missing goals, and check everything before any work.

        Args:
            overwrite: replace drawn goals that are not as the experiment says.

        Raises:
            RealBenchError: a controller, a setting, the scene or goals cannot be used.
        """
        self._check_controllers()
        load_scene(self.spec.scene_source)  # is it installed?
        plan = self.plan()
        for name in plan.goals.draw(overwrite=overwrite):
            log.info("drawing %s", name)
        plan.goals.check()
        self._check_goals()

    def missing(self, *, resume: bool = False, overwrite: bool = False) -> PendingJobs:
        """The plays and tests that are not there yet.

        Args:
            resume: continue interrupted plays, which are then not bit for bit the same.
            overwrite: replace files that do not belong to this experiment.
        """
        return self.plan().pending(resume=resume, overwrite=overwrite)

    def check(self, work: PendingJobs) -> None:
        """Find out before any work whether it can be done: every controller plays a few steps.

        This happens in a process of its own, since a controller may end its process. Isolated
        controllers are left out: they are other people's, and a failing one must not stop the rest.

        Raises:
            ExperimentError: something cannot be done, and why.
        """
        if work.outdated:
            first = work.outdated[0]
            raise ExperimentError(
                f"{first.play} must be played again, since its recording is gone, but "
                f"{counted(len(work.outdated), 'finished test')} of such plays ({first.out.name} "
                "...) learned from what was recorded: put the recording back, use another "
                "results folder, or make these tests again with --overwrite"
            )
        if self.isolate:
            return
        processes = Processes(self.spec.results_folder / "logs")
        check = work.check
        try:
            try:
                processes.do(check, _ignore)
            except WorkerLostError:  # of which of them?
                for each in check.jobs:
                    alone = check.model_copy(update={"name": each.name, "jobs": (each,)})
                    processes.do(alone, _ignore)
                raise
        except (JobFailedError, WorkerLostError) as error:
            reason = str(error).removeprefix(f"{check.name}: ")
            raise ExperimentError(f"before any work: {reason}") from error

    def make(self, work: PendingJobs, update: OnProgress) -> dict[str, Failure]:
        """Run the jobs; returns why jobs failed, by name.

        Raises:
            Interrupted: the user stopped it.
        """
        scheduler = job_scheduler(self.spec.results_folder, self.n_at_once, self.scheduler)
        return scheduler.do(work, update)

    def rows(self) -> list[Row]:
        """The table from the results so far; raises ExperimentError."""
        return rows_of(self.spec, self.plan())

    @contextlib.contextmanager
    def lock_folder(self) -> Iterator[None]:
        """Lock the experiment's folder, so that no other process runs the same experiment."""
        folder = self.spec.results_folder
        check_folder(folder, make=True)
        with write_lock(folder / "table"):
            yield

    def plan(self) -> ExperimentPlan:
        """Its jobs and their states now; each file is read once, when it is first asked for."""
        return ExperimentPlan(self.spec, isolate=self.isolate, limits=self.limits)

    def _check_controllers(self) -> None:
        spec = self.spec
        played = [found[1].controller for cell in spec.cells if (found := spec.play_of(cell))]
        for named in {*played, *(cell.controller for cell in spec.cells)}:
            ControllerSource.of(spec.controller(named)).code_files()
        self.plan().check_settings()

    def _check_goals(self) -> None:
        spec = self.spec
        scene = load_scene(spec.scene_source)
        goals = {(name, cell.objects) for cell in spec.cells for name in spec.goal_names(cell)}
        for name, objects in sorted(goals):
            load_goal_set(spec.goal_file(name, objects)).check_fits(scene, objects)


def _ignore(done: int, busy: str = "") -> None:
    """A check takes a moment."""
