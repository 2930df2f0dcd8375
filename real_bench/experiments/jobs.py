"""The kinds of jobs: plays, tests, and the check before any work whether these can be done.

A job is plain data with everything it takes, so that another process or machine can do it.
"""

from __future__ import annotations

import platform
from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Protocol

from pydantic import Field, TypeAdapter

from real_bench.conditions import Condition
from real_bench.errors import (
    ControllerError,
    ExperimentError,
    RealBenchError,
    in_short,
)
from real_bench.files.kinds import RECORDING, RESULT, FileKind
from real_bench.files.outputs import is_of_kind
from real_bench.inputs.records import Record
from real_bench.phases.activity import Activity, ignore_activity
from real_bench.phases.local import LocalBackend
from real_bench.phases.proxy import ControllerBackend
from real_bench.sandbox.limits import Limits

if TYPE_CHECKING:
    from real_bench.scoring.result import Result


class OnSteps(Protocol):
    """Called with the progress of a job."""

    def __call__(self, done: int, busy: str = "") -> None:
        """Some steps are done.

        Args:
            done: how many.
            busy: what its controller has been busy with for a while; empty while it plays.
        """


class _Job(Record, ABC):
    """What plays and tests have.

    Attributes:
        name: unique in the experiment.
        controller: name, ``module:Class`` or file.
        condition, objects, scene, seed, settings: of the play or test.
        scene_name: the scene's own name, since it may be given by its manifest.
        out: the file it writes.
        isolate: run the controller in a process of its own, in a sandbox.
        limits: what an isolated controller may use up.
    """

    name: str
    controller: str
    condition: str
    objects: int
    scene: str
    scene_name: str
    seed: int
    settings: dict[str, Any]
    out: Path
    isolate: bool = False
    limits: Limits = Limits()

    @property
    def backend(self) -> ControllerBackend:
        """Where its controller runs: it must not read its goals or what is written.

        Raises ExperimentError if this machine, which may be far away, cannot ensure that.
        """
        if not self.isolate:
            return LocalBackend()
        from real_bench.sandbox import SandboxBackend

        backend = SandboxBackend((self.out.parent, *self.inputs.values()), self.limits)
        if not backend.support.keep_files:
            raise ExperimentError(
                f"{self.controller} cannot be isolated on {platform.node()}: install bubblewrap"
            )
        return backend

    def settings_in_full(self) -> Mapping[str, Any]:
        """All settings of its controller, as plain values; raises ControllerError."""
        return self.backend.identity(self.controller, self.settings).settings

    @property
    @abstractmethod
    def n_steps(self) -> int:
        """How many steps of simulation there are to do."""

    @property
    @abstractmethod
    def inputs(self) -> dict[str, Path]:
        """The files it needs, by field."""

    @abstractmethod
    def do(self, report: OnSteps, activity: Activity = ignore_activity) -> None:
        """Do it, and write the file; raises RealBenchError.

        Args:
            report: called with the steps that are done.
            activity: called with what the controller is busy with.
        """


class PlayJob(_Job):
    """An intrinsic phase.

    Attributes:
        steps, images: of the phase.
        resume: continue an interrupted recording; otherwise start over, since a resumed run is not
            bit for bit the uninterrupted one.
    """

    kind: Literal["play"] = "play"
    steps: int
    images: bool | None
    resume: bool = False

    @property
    def n_steps(self) -> int:  # noqa: D102
        return self.steps

    @property
    def inputs(self) -> dict[str, Path]:  # noqa: D102
        return {}

    def do(self, report: OnSteps, activity: Activity = ignore_activity) -> None:
        """Play."""
        from real_bench.phases.intrinsic import IntrinsicPhase
        from real_bench.simulation import load_scene

        phase = IntrinsicPhase(
            controller=self.controller,
            condition=Condition.parse(self.condition),
            objects=self.objects,
            scene=load_scene(self.scene),
            steps=self.steps,
            seed=self.seed,
            out=self.out,
            images=self.images,
            settings=self.settings,
            backend=self.backend,
        )
        _remove_damaged(self.out, RECORDING)
        phase.run(
            lambda progress: report(progress.n_steps),
            resume=self.resume,
            overwrite=not self.resume,
            activity=activity,
        )


class ScoringJob(_Job):
    """An extrinsic phase on one goal set.

    Attributes:
        trial_steps: length of a trial.
        goals: the goal set's file, with ``n_goals`` goals.
        goals_sha256: hash of the goal set's content; empty while it is not drawn yet.
        run: the recording to learn from, of ``run_steps`` steps; None, 0 if there is none.
        play: the name of the job that makes the recording, if there is one.
    """

    kind: Literal["scoring"] = "scoring"
    trial_steps: int
    goals: Path
    n_goals: int
    goals_sha256: str
    run: Path | None
    run_steps: int
    play: str | None

    @property
    def n_steps(self) -> int:  # noqa: D102
        return self.n_goals * self.trial_steps

    @property
    def inputs(self) -> dict[str, Path]:  # noqa: D102
        return {"goals": self.goals, **({"run": self.run} if self.run else {})}

    def do(self, report: OnSteps, activity: Activity = ignore_activity) -> None:
        """Test; continues a result of the same test."""
        from real_bench.goal_sets import load_goal_set
        from real_bench.phases.extrinsic import ExtrinsicPhase, NotResumableError
        from real_bench.phases.trial import TrialPlan
        from real_bench.simulation import load_scene

        plan = TrialPlan(
            controller=self.controller,
            condition=Condition.parse(self.condition),
            scene=load_scene(self.scene),
            goal_set=load_goal_set(self.goals),
            seed=self.seed,
            trial_steps=self.trial_steps,
            run=self.run,
            settings=self.settings,
            backend=self.backend,
        )
        phase = ExtrinsicPhase(plan, len(plan.goal_set), self.out)

        def update(result: Result) -> None:
            report(len(result.trials) * self.trial_steps)

        _remove_damaged(self.out, RESULT)
        try:
            phase.run(update, resume=True, activity=activity)
        except (
            NotResumableError
        ):  # damaged, begun by other code, or by a controller that cannot go on
            phase.run(update, overwrite=True, activity=activity)


def _remove_damaged(path: Path, kind: FileKind) -> None:
    """Remove what the plan has agreed to replace, though no other command would."""
    if path.is_file() and not is_of_kind(path, kind):
        path.unlink()


Job = PlayJob | ScoringJob


class CheckJob(Record):
    """A quick check whether jobs can be done: their controllers play a few steps.

    Attributes:
        name: of its log.
        jobs: what to check; one of each group of jobs that differ in nothing that matters.
        plays: future plays that the tests among them learn from, by name.
    """

    kind: Literal["check"] = "check"
    name: str = "check"
    jobs: tuple[Annotated[Job, Field(discriminator="kind")], ...]
    plays: dict[str, PlayJob]

    def do(self, report: OnSteps, activity: Activity = ignore_activity) -> None:
        """Try each of them; raises ControllerError with all that is wrong."""
        wrong: dict[str, str] = {}
        for number, job in enumerate(self.jobs):
            report(number)
            try:
                self._check(job)
            except RealBenchError as error:
                wrong.setdefault(str(error), job.name)
        if wrong:
            raise ControllerError(in_short([f"{name}: {what}" for what, name in wrong.items()]))

    def _check(self, job: Job) -> None:
        from real_bench.phases.checking import LOSES_ALL, ControllerCheck
        from real_bench.simulation import load_scene

        condition = Condition.parse(job.condition)
        play = self.plays.get(job.play or "") if isinstance(job, ScoringJob) else None
        if play is not None:
            self._check_can_learn(job, play, condition)
        scene = load_scene(job.scene)
        check = ControllerCheck(
            job.controller,
            condition,
            scene,
            job.objects,
            job.settings,
            job.backend,
            is_tested_elsewhere=play is not None and play.controller == job.controller,
        )
        for finding in check.findings():
            if finding.good:
                continue
            nothing = ". If it learns nothing, give its cell `play: none`"
            raise ControllerError(finding.detail + nothing * (finding.detail == LOSES_ALL))

    def _check_can_learn(self, job: Job, play: PlayJob, condition: Condition) -> None:
        """Raise ControllerError if a play lacks the images that a test would learn from."""
        if condition.sees_objects or not Condition.parse(play.condition).sees_objects:
            return
        learns = job.backend.identity(job.controller, job.settings).learns_from_experience
        recorded = play.images
        if recorded is None:
            recorded = play.backend.identity(play.controller, play.settings).uses_images
        if learns and not recorded:
            raise ControllerError(
                f"it learns from images, but play {play.name} records none: give that play "
                "`images: true`"
            )


_ADAPTER: TypeAdapter[Job | CheckJob] = TypeAdapter(
    Annotated[PlayJob | ScoringJob | CheckJob, Field(discriminator="kind")]
)


def job_from_json(text: str) -> Job | CheckJob:
    """The job that ``model_dump_json`` wrote; raises ValueError."""
    return _ADAPTER.validate_json(text)
