"""The two kinds of work of an experiment: to play, and to be tested.

A task says all that it takes to do it, as plain data, so that another process or machine can.
"""

from __future__ import annotations

import platform
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from real_bench.errors import ControllerError, ResultError
from real_bench.phases.guest import Host
from real_bench.phases.local import LocalHost

Report = Callable[[int], None]
"""Told how many steps are done."""


class _Task(BaseModel, ABC):
    """What both kinds say.

    Attributes:
        name: unique in the experiment.
        controller: name, ``module:Class`` or file.
        condition, objects, scene, seed, settings: of the play or test.
        scene_name: what the scene, which may be told by its manifest, calls itself.
        out: the file it writes.
        isolate: have the controller in a process of its own, within walls.
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

    @property
    def host(self) -> Host:
        """Where its controller runs: not where it can read what is written, or its goals.

        Raises ControllerError where this machine, which may be far away, cannot see to that.
        """
        if not self.isolate:
            return LocalHost()
        from real_bench.isolation import IsolatedHost

        host = IsolatedHost((self.out.parent, *self.inputs.values()))
        if not host.walls.keep_files:
            raise ControllerError(
                f"{self.controller} cannot be isolated on {platform.node()}: install bubblewrap"
            )
        return host

    def settings_in_full(self) -> Mapping[str, Any]:
        """All settings of its controller, as plain values; raises ControllerError."""
        return self.host.identity(self.controller, self.settings).settings

    @property
    @abstractmethod
    def n_steps(self) -> int:
        """How many steps of simulation there are to do."""

    @property
    @abstractmethod
    def inputs(self) -> dict[str, Path]:
        """The files it needs, by field."""

    @abstractmethod
    def do(self, report: Report) -> None:
        """Do it, and write the file; raises RealBenchError."""


class PlayTask(_Task):
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

    def do(self, report: Report) -> None:
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
            host=self.host,
        )
        phase.run(
            lambda progress: report(progress.n_steps), resume=self.go_on, overwrite=not self.go_on
        )


class ScoringTask(_Task):
    """An extrinsic phase on one goal set.

    Attributes:
        trial_steps: length of a trial.
        goals: the goal set's file, with ``n_goals`` goals.
        goals_sha256: hash of the goal set's content; empty while it is not drawn yet.
        run: the recording to learn from, of ``run_steps`` steps; None, 0 if there is none.
        play: the name of the task that makes the recording, where there is one.
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

    def do(self, report: Report) -> None:
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
            host=self.host,
        )
        phase = ExtrinsicPhase(plan, len(plan.goal_set), self.out)
        try:
            phase.run(lambda result: report(len(result.trials) * self.trial_steps), resume=True)
        except ResultError:  # begun by other code, or by a controller that cannot go on
            phase.run(lambda result: report(len(result.trials) * self.trial_steps), overwrite=True)


Task = PlayTask | ScoringTask
_ADAPTER: TypeAdapter[Task] = TypeAdapter(Annotated[Task, Field(discriminator="kind")])


def task_from_json(text: str) -> Task:
    """The task that ``model_dump_json`` wrote; raises ValueError."""
    return _ADAPTER.validate_json(text)
