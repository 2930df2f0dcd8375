"""The two kinds of work of an experiment: to play, and to be tested.

A job says all that it takes to do it, as plain data, so that another process or machine can.
"""

from __future__ import annotations

import platform
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from real_bench.errors import ExperimentError, ResultError
from real_bench.phases.local import LocalBackend
from real_bench.phases.proxy import ControllerBackend
from real_bench.sandbox.limits import Limits

OnSteps = Callable[[int], None]
"""Told how many steps are done."""


class _Job(BaseModel, ABC):
    """What both kinds say.

    Attributes:
        name: unique in the experiment.
        controller: name, ``module:Class`` or file.
        condition, objects, scene, seed, settings: of the play or test.
        scene_name: what the scene, which may be told by its manifest, calls itself.
        out: the file it writes.
        isolate: have the controller in a process of its own, in a sandbox.
        limits: what an isolated controller may use up.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

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
        """Where its controller runs: not where it can read what is written, or its goals.

        Raises ExperimentError where this machine, which may be far away, cannot see to that.
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
    def do(self, report: OnSteps) -> None:
        """Do it, and write the file; raises RealBenchError."""


class PlayJob(_Job):
    """An intrinsic phase.

    Attributes:
        steps, images: of the phase.
        go_on: go on with a recording that was cut; else it begins anew, since a resumed run is
            not bit for bit the uninterrupted one.
    """

    kind: Literal["play"] = "play"
    steps: int
    images: bool | None
    go_on: bool = False

    @property
    def n_steps(self) -> int:  # noqa: D102
        return self.steps

    @property
    def inputs(self) -> dict[str, Path]:  # noqa: D102
        return {}

    def do(self, report: OnSteps) -> None:
        """Play."""
        from real_bench.conditions import Condition
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
        phase.run(
            lambda progress: report(progress.n_steps), resume=self.go_on, overwrite=not self.go_on
        )


class ScoringJob(_Job):
    """An extrinsic phase on one goal set.

    Attributes:
        trial_steps: length of a trial.
        goals: the goal set's file, with ``n_goals`` goals.
        goals_sha256: hash of the goal set's content; empty while it is not drawn yet.
        run: the recording to learn from, of ``run_steps`` steps; None, 0 if there is none.
        play: the name of the job that makes the recording, where there is one.
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

    def do(self, report: OnSteps) -> None:
        """Test, going on with a result of the same test."""
        from real_bench.conditions import Condition
        from real_bench.goal_sets import load_goal_set
        from real_bench.phases.extrinsic import ExtrinsicPhase
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
        try:
            phase.run(lambda result: report(len(result.trials) * self.trial_steps), resume=True)
        except ResultError:  # begun by other code, or by a controller that cannot go on
            phase.run(lambda result: report(len(result.trials) * self.trial_steps), overwrite=True)


Job = PlayJob | ScoringJob
_ADAPTER: TypeAdapter[Job] = TypeAdapter(Annotated[Job, Field(discriminator="kind")])


def job_from_json(text: str) -> Job:
    """The job that ``model_dump_json`` wrote; raises ValueError."""
    return _ADAPTER.validate_json(text)
