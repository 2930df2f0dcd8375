"""The extrinsic phase: 50 goals never seen before (paper, section Metrics)."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from real_bench.errors import Interrupted, RealBenchError, ResultError
from real_bench.files import check_output, file_sha256, write_lock
from real_bench.phases.guest import Guest, Identity
from real_bench.phases.stopping import STOP_SIGNALS, StopRequest, stop_requests
from real_bench.phases.trial import TrialMaker, TrialPlan
from real_bench.recording import Recording, package_versions
from real_bench.scoring.result import Result, Setting, TrialResult, load_result

Report = Callable[[Result], None]
_Trial = Future[tuple[TrialResult, float]]


@dataclass(frozen=True)
class ExtrinsicPhase:
    """An extrinsic phase to be run.

    Attributes:
        plan: what is tested.
        n_trials: how many of the goals, from the first on.
        out: the result file.
        jobs: number of processes; the scores do not depend on it.
    """

    plan: TrialPlan
    n_trials: int
    out: Path
    jobs: int = 1

    def __post_init__(self) -> None:
        n_goals = len(self.plan.goal_set)
        if not 1 <= self.n_trials <= n_goals:
            raise RealBenchError(f"--trials must be 1 to {n_goals}, not {self.n_trials}")
        if self.jobs < 1:
            raise RealBenchError(f"--jobs must be at least 1, not {self.jobs}")
        if not 0 <= self.plan.seed < 2**63:
            raise RealBenchError(f"--seed must be 0 to 2**63 - 1, not {self.plan.seed}")
        if self.plan.trial_steps < 1:
            raise RealBenchError(f"a trial needs at least 1 step, not {self.plan.trial_steps}")
        self.plan.goal_set.check_fits(self.plan.scene, self.plan.goal_set.n_objects)

    def run(
        self,
        report: Report,
        *,
        resume: bool = False,
        overwrite: bool = False,
        guest: Guest | None = None,
    ) -> Result:
        """Test every goal; the result file is written anew after each.

        Args:
            report: told of the result so far, after every trial.
            resume: go on with the result file where there is one.
            overwrite: replace the result file where there is one.
            guest: the controller as an intrinsic phase in this process left it.

        Raises:
            Interrupted: the user stopped it; ``resume`` goes on.
            ControllerError: the controller failed; earlier trials are kept.
            RealBenchError: anything else that is wrong, before or while it runs.
        """
        check_output(self.out, overwrite=True)  # whether it can be written at all
        with write_lock(self.out), stop_requests() as stop:
            resume = resume and self.out.exists()
            remedy = "--overwrite" if guest else "--resume or --overwrite"
            check_output(self.out, overwrite=overwrite or resume, remedy=remedy)
            identity = self._identity() if guest is None else guest.identity
            result = self._begun(identity, resume)
            for trial, seconds in self._trials(identity, result, guest, stop):
                result = result.with_trial(trial, seconds)
                result.save(self.out)
                report(result)
        if not result.is_complete:
            raise Interrupted(
                f"stopped after {len(result.trials)} of {self.n_trials} trials; they are in "
                f"{self.out}{'' if guest else ': repeat the command with --resume'}"
            )
        return result

    def _identity(self) -> Identity:
        return self.plan.host.identity(self.plan.controller, self.plan.settings)

    def _begun(self, identity: Identity, resume: bool) -> Result:
        """An empty result, or the one to be resumed."""
        setting = self._setting(identity)
        if not resume:
            return Result(setting=setting)
        result = load_result(self.out)
        changed = [
            name
            for name in Setting.model_fields
            if name != "n_goals" and getattr(result.setting, name) != getattr(setting, name)
        ]
        if changed:
            raise ResultError(
                f"{self.out} cannot be resumed, it is of another test: {', '.join(changed)} differ"
            )
        if result.trials and result.trials[-1].goal >= self.n_trials:
            raise ResultError(
                f"{self.out} already holds goal {result.trials[-1].goal}, beyond the "
                f"{self.n_trials} trials asked"
            )
        return result.model_copy(update={"setting": setting})

    def _trials(
        self, identity: Identity, result: Result, guest: Guest | None, stop: StopRequest
    ) -> Iterator[tuple[TrialResult, float]]:
        done = {trial.goal for trial in result.trials}
        left = [number for number in range(self.n_trials) if number not in done]
        if not left:
            return
        if self.jobs > 1 and guest is None and not identity.learns_across_trials:
            yield from self._in_processes(left, stop)
            return
        maker = TrialMaker(self.plan, guest)
        try:
            if maker.in_order and done:
                raise ResultError(
                    f"{self.out} cannot be resumed: the controller learns from trial to trial, "
                    "and what it had learned is lost; use --overwrite"
                )
            for number in left:
                if stop.made:
                    return
                yield maker.make(number)
        finally:
            maker.close()

    def _in_processes(
        self, left: list[int], stop: StopRequest
    ) -> Iterator[tuple[TrialResult, float]]:
        pool = ProcessPoolExecutor(
            min(self.jobs, len(left)),
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_start_worker,
            initargs=(self.plan,),
        )
        waiting = iter(left)
        failed = None
        try:
            running = _submit(pool, islice(waiting, self.jobs))
            while running:
                done, running = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    if future.exception() is None:
                        yield future.result()
                    else:
                        failed = future  # what else is being tested may still come to its end
                if failed is None and not stop.made:
                    running |= _submit(pool, islice(waiting, len(done)))
            if failed is not None:
                failed.result()
        except BrokenProcessPool as error:
            raise RealBenchError(
                "a worker process died; trials that were finished are kept: "
                "repeat the command with --resume"
            ) from error
        finally:
            pool.shutdown(cancel_futures=True)

    def _setting(self, identity: Identity) -> Setting:
        plan = self.plan
        run_sha256, run_steps = _run_identity(plan.run)
        return Setting(
            condition=plan.condition.name,
            objects=plan.goal_set.n_objects,
            object_names=plan.goal_set.object_names,
            scene=plan.scene.name,
            scene_sha256=plan.scene.sha256,
            controller=plan.controller,
            controller_sha256=identity.source_sha256,
            settings=dict(identity.settings),
            run_sha256=run_sha256,
            run_steps=plan.run_steps or run_steps,
            goals_sha256=plan.goal_set.sha256,
            n_goals=self.n_trials,
            trial_steps=plan.trial_steps,
            seed=plan.seed,
            versions=package_versions(),
        )


def _run_identity(run: Path | None) -> tuple[str, int]:
    if run is None:
        return "", 0
    with Recording(run) as recording:
        n_steps = recording.n_steps
    return file_sha256(run), n_steps


def _submit(pool: ProcessPoolExecutor, numbers: Iterable[int]) -> set[_Trial]:
    """Have trials made; workers are started with the signals to stop held back.

    A worker that is interrupted before it has begun would leave the pool hanging.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)
    try:
        return {pool.submit(_make_trial, number) for number in numbers}
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)


class _Worker:
    """What a worker process keeps between trials; a process has no other place for it."""

    plan: TrialPlan
    maker: TrialMaker | None = None


def _start_worker(plan: TrialPlan) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides when to stop
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)
    sys.stdout = sys.stderr  # what a controller prints is no result
    logging.basicConfig(format="%(message)s")
    logging.getLogger("real_bench").setLevel(logging.INFO)
    threading.Thread(target=_die_with_parent, daemon=True).start()
    _Worker.plan = plan


def _die_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _make_trial(number: int) -> tuple[TrialResult, float]:
    if _Worker.maker is None:  # made here and not at the start, so that its errors are reported
        _Worker.maker = TrialMaker(_Worker.plan)
    return _Worker.maker.make(number)
