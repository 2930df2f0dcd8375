"""The extrinsic phase: 50 goals never seen before (paper, section Metrics)."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from real_bench.controller_code.source import recorded_name
from real_bench.errors import Interrupted, RecordingError, ResultError
from real_bench.files.hashing import file_sha256
from real_bench.files.kinds import RESULT
from real_bench.files.locks import write_lock
from real_bench.files.outputs import check_output
from real_bench.goal_sets import goals_in_proportion
from real_bench.inputs.whole import keep_whole
from real_bench.phases.activity import Activity, ignore_activity
from real_bench.phases.handover import NOTHING, Handover
from real_bench.phases.proxy import ControllerProxy, Identity
from real_bench.phases.stopping import StopRequest, stop_requests
from real_bench.phases.trial import TrialMaker, TrialPlan
from real_bench.phases.workers import in_processes
from real_bench.provenance import run_versions
from real_bench.recording import Recording
from real_bench.scoring.commands import largest_length
from real_bench.scoring.result import LearnedFrom, Result, Setting, TrialResult, load_result
from real_bench.scoring.result_file import MAX_FILE_BYTES
from real_bench.text.counting import counted
from real_bench.text.quoting import quoted

OnTrial = Callable[[Result], None]

log = logging.getLogger(__name__)

GONE: tuple[int, ...] = ()
LOST_WORKER = "finished trials are kept: repeat the command with --resume"


class NotResumableError(ResultError):
    """A result that this test cannot go on with."""


@dataclass(frozen=True)
class ExtrinsicPhase:
    """An extrinsic phase to run.

    Attributes:
        plan: what is tested.
        n_trials: how many of the goals, each class in proportion.
        out: the result file.
        jobs: number of processes; the scores do not depend on it.
    """

    plan: TrialPlan
    n_trials: int
    out: Path
    jobs: int = 1

    def __post_init__(self) -> None:
        keep_whole(self, "n_trials", 1, len(self.plan.goal_set))
        keep_whole(self, "jobs", 1)
        self.plan.goal_set.check_fits(self.plan.scene, self.plan.goal_set.n_objects)

    def run(
        self,
        report: OnTrial,
        *,
        resume: bool = False,
        overwrite: bool = False,
        proxy: ControllerProxy | None = None,
        activity: Activity = ignore_activity,
    ) -> Result:
        """Test every goal; the result file is rewritten after each.

        Args:
            report: called with the result so far, after every trial.
            resume: continue the result file if it exists.
            overwrite: replace the result file if it exists.
            proxy: the controller as an intrinsic phase in this process left it.
            activity: called with what the controller is busy with.

        Raises:
            Interrupted: the user stopped it; ``resume`` continues.
            NotResumableError: the result cannot be continued; nothing was done.
            ControllerError: the controller failed; earlier trials are kept.
            RealBenchError: anything else that is wrong, before or while it runs.
        """
        check_output(self.out, overwrite=True, kind=RESULT)  # can it be written at all?
        self.plan.check_outputs()
        if proxy is None:
            self.plan.check_recording()
        with write_lock(self.out), stop_requests() as stop:
            resume = resume and self.out.exists()
            remedy = "--overwrite" if proxy else "--resume or --overwrite"
            check_output(self.out, overwrite=overwrite or resume, remedy=remedy)
            identity = self._identity() if proxy is None else proxy.identity
            self._warn_of_size(identity)
            given = self.plan.handover(identity) if proxy is None else NOTHING
            recording = _stamp(self.plan.run)
            setting = self._setting(identity, given, is_same_process=proxy is not None)
            result = self._initial_result(setting, resume)
            for trial, seconds in self._trials(identity, result, proxy, given, stop, activity):
                if _stamp(self.plan.run) not in (recording, GONE):
                    raise RecordingError(
                        f"{self.plan.run} was replaced or changed during the test: test again "
                        f"(--overwrite); {self.out} has the trials before"
                    )
                result = result.with_trial(trial, seconds)
                result.save(self.out)
                report(result)
            if not result.is_finished:
                if not result.trials:
                    raise Interrupted("stopped before the first trial ended: nothing is kept")
                done = f"{len(result.trials)} of {self.n_trials} trials"
                raise Interrupted(
                    f"stopped after {done}; they are in {self.out}", can_resume=proxy is None
                )
        return result

    @property
    def goal_numbers(self) -> tuple[int, ...]:
        """The goals to test, ascending; they include those of a shorter test."""
        return goals_in_proportion(self.plan.goal_set.classes, self.n_trials)

    def _identity(self) -> Identity:
        identity = self.plan.backend.identity(self.plan.controller, self.plan.settings)
        recording = f"; recording: {self.plan.run}" if self.plan.run else ""
        log.info("controller: %s%s", identity, recording)
        return identity

    def _warn_of_size(self, identity: Identity) -> None:
        """Say before hours of work that they may end in a file that cannot be written."""
        n_steps, size = self.plan.trial_steps, self.plan.condition.control_type.size
        most = MAX_FILE_BYTES // largest_length(size, n_steps)
        if self.n_trials > most and not identity.action_level:
            log.warning(
                "a controller that commands something else at each step fills a result with %s: "
                "test fewer goals at once, or it may end there",
                counted(most, "trial"),
            )

    def _initial_result(self, setting: Setting, resume: bool) -> Result:
        """An empty result, or the one to be resumed."""
        if not resume:
            return Result(setting=setting)
        try:
            result = load_result(self.out)
        except ResultError as error:
            raise NotResumableError(str(error)) from error
        if changed := list(_differences(result.setting, setting)):
            raise NotResumableError(
                f"{self.out} is of another test and cannot be resumed: {', '.join(changed)} "
                "differ; use --overwrite, or another --out"
            )
        if not result.keeps_commands:
            raise NotResumableError(
                f"{self.out} is too old to be resumed, it keeps no commands: use --overwrite"
            )
        tested = {trial.goal for trial in result.trials}
        if more := sorted(tested - set(self.goal_numbers)):
            raise NotResumableError(
                f"{self.out} already holds goal {more[0]}, beyond the first {self.n_trials} trials"
            )
        return result.model_copy(update={"setting": setting})

    def _trials(
        self,
        identity: Identity,
        result: Result,
        proxy: ControllerProxy | None,
        given: Handover,
        stop: StopRequest,
        activity: Activity,
    ) -> Iterator[tuple[TrialResult, float]]:
        done = {trial.goal for trial in result.trials}
        left = [number for number in self.goal_numbers if number not in done]
        if not left:
            return
        if self.jobs > 1 and proxy is None and not identity.learns_across_trials:
            jobs = min(self.jobs, len(left))
            yield from in_processes(
                partial(_make_trial_function, self.plan, given),
                left,
                jobs,
                stop,
                LOST_WORKER,
                activity,
            )
            return
        with closing(TrialMaker(self.plan, proxy, given, activity=activity)) as maker:
            if maker.in_order and done:
                raise NotResumableError(
                    f"{self.out} cannot be resumed: the controller learns across trials, "
                    "and what it learned is lost; use --overwrite"
                )
            for number in left:
                if stop.requested:
                    break
                yield maker.make(number)
            maker.end()

    def _setting(self, identity: Identity, given: Handover, *, is_same_process: bool) -> Setting:
        plan = self.plan
        if not plan.controller.isprintable():
            raise ResultError(
                f"a result cannot store the name {plan.controller!r}: rename the controller"
            )
        run_sha256, run_steps = _run_identity(plan.run)
        return Setting(
            condition=plan.condition.name,
            control_version=plan.condition.control_version,
            objects=plan.goal_set.n_objects,
            object_names=plan.goal_set.object_names,
            scene=plan.scene.name,
            scene_sha256=plan.scene.sha256,
            controller=recorded_name(plan.controller),
            controller_sha256=identity.code_sha256,
            settings=dict(identity.settings),
            learned=given.learned,
            learned_from="process" if is_same_process else self._learned_from(identity, given),
            run_sha256=run_sha256,
            run_steps=plan.run_steps or run_steps,
            goals_sha256=plan.goal_set.sha256,
            n_goals=len(plan.goal_set),
            goal_numbers=self.goal_numbers,
            trial_steps=plan.trial_steps,
            seed=plan.seed,
            versions=run_versions(),
        )

    def _learned_from(self, identity: Identity, given: Handover) -> LearnedFrom:
        if given.learned is not None:
            return "state"
        learns = self.plan.run is not None and identity.learns_from_experience
        return "triplets" if learns else "nothing"


def _stamp(run: Path | None) -> tuple[int, ...]:
    """What differs when a recording was replaced or changed."""
    with suppress(OSError):
        if run is not None:
            status = run.stat()
            return (status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns)
    return GONE


def _run_identity(run: Path | None) -> tuple[str, int]:
    if run is None:
        return "", 0
    with Recording(run) as recording:
        n_steps = recording.n_steps
    return file_sha256(run), n_steps


def _make_trial_function(
    plan: TrialPlan, given: Handover
) -> Callable[[int], tuple[TrialResult, float]]:
    return TrialMaker(plan, given=given).make


def _differences(then: Setting, now: Setting) -> Iterator[str]:
    """What differs between two tests; of versions, which."""
    for name in Setting.model_fields:
        if name in ("goal_numbers", "versions"):
            continue
        if name == "learned_from" and then.learned_from is None:  # made before it was kept
            continue
        if getattr(then, name) != getattr(now, name):
            yield name
    for name in sorted({*then.versions, *now.versions}):
        old, new = then.versions.get(name, "none"), now.versions.get(name, "none")
        if old != new:
            yield f"{quoted(name)} ({quoted(old)} then, {quoted(new)} now)"
