"""The jobs of an experiment, and which of them are left."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from real_bench.experiments.goal_files import GoalFiles
from real_bench.experiments.job_state import JobState, mismatch_error, mismatch_message, state_of
from real_bench.experiments.jobs import CheckJob, Job, PlayJob, ScoringJob
from real_bench.experiments.spec import Cell, Play, Spec
from real_bench.sandbox.limits import Limits
from real_bench.text.counting import counted

_T = TypeVar("_T", PlayJob, ScoringJob)


@dataclass(frozen=True)
class PendingJobs:
    """The jobs that are left.

    Attributes:
        plays: intrinsic phases.
        scorings: tests; some of them wait for a play.
        outdated: finished tests that would no longer fit, since their recording is gone, and other
            tests need one like it.
    """

    plays: tuple[PlayJob, ...]
    scorings: tuple[ScoringJob, ...]
    outdated: tuple[ScoringJob, ...] = ()

    def __str__(self) -> str:
        """``2 plays and 1 test, 26,000 steps in total``."""
        plays, tests = counted(len(self.plays), "play"), counted(len(self.scorings), "test")
        return f"{plays} and {tests}, {self.n_steps:,} steps in total"

    @property
    def n_steps(self) -> int:
        """How many steps of simulation there are to do."""
        return sum(job.n_steps for job in (*self.plays, *self.scorings))

    @property
    def check(self) -> CheckJob:
        """A quick check whether all of them can be done."""
        plays = {job.name: job for job in self.plays}
        unlike: dict[str, Job] = {}
        jobs: tuple[Job, ...] = (*self.plays, *self.scorings)
        for job in jobs:
            learned = plays.get(job.play or "") if isinstance(job, ScoringJob) else None
            played = learned and (learned.controller, learned.condition, learned.images)
            facts = [job.controller, job.condition, job.objects, job.settings, played]
            unlike.setdefault(json.dumps(facts, sort_keys=True), job)
        needed = {job.play for job in unlike.values() if isinstance(job, ScoringJob)}
        return CheckJob(
            jobs=tuple(unlike.values()),
            plays={name: job for name, job in plays.items() if name in needed},
        )

    def __len__(self) -> int:
        return len(self.plays) + len(self.scorings)


class ExperimentPlan:
    """All jobs of an experiment and their states, as they were when first asked for.

    Args:
        spec: the experiment.
        isolate: run every controller in a process of its own, in a sandbox.
        limits: what an isolated controller may use up.
    """

    def __init__(self, spec: Spec, *, isolate: bool = False, limits: Limits | None = None) -> None:
        self._spec = spec
        self._isolate, self._limits = isolate, limits or Limits()
        self._states: dict[Path, JobState] = {}
        self.goals = GoalFiles(spec)

    def state(self, job: Job) -> JobState:
        """The state of a job when it was first asked for."""
        if job.out not in self._states:
            self._states[job.out] = state_of(job)
        return self._states[job.out]

    def scorings(self, cell: Cell, seed: int) -> list[ScoringJob]:
        """The tests of one repeat of a cell, one per goal set."""
        spec, play = self._spec, self.play(cell, seed)
        return [
            ScoringJob(
                **self._shared_fields(
                    f"{cell.name}-seed{seed}-{goals}", cell, cell.objects, seed, ".json"
                ),
                trial_steps=spec.trial_steps,
                goals=self.goals[goals, cell.objects].path,
                n_goals=self.goals[goals, cell.objects].n_goals,
                goals_sha256=self.goals[goals, cell.objects].sha256,
                run=play.out if play else None,
                run_steps=play.steps if play else 0,
                play=play.name if play else None,
            )
            for goals in spec.goal_names(cell)
        ]

    def play(self, cell: Cell, seed: int) -> PlayJob | None:
        """What one repeat of a cell learns from; cells that share a play get the same job."""
        found = self._spec.play_of(cell)
        if found is None:
            return None
        name, play = found
        return PlayJob(
            **self._shared_fields(f"{name}-seed{seed}", play, cell.objects, seed, ".h5"),
            steps=self._spec.steps,
            images=play.images,
        )

    def check_settings(self) -> None:
        """Check before any work that controllers accept their settings.

        Raises:
            ControllerError: they are not.
        """
        checked: list[tuple[str, dict[str, Any]]] = []
        for cell in self._spec.cells:
            seed = self._spec.seeds(cell)[0]
            for job in (*self.scorings(cell, seed), self.play(cell, seed)):
                if job is not None and job.settings:
                    if (job.controller, job.settings) not in checked:
                        job.settings_in_full()
                    checked.append((job.controller, job.settings))

    def pending(self, *, resume: bool = False, overwrite: bool = False) -> PendingJobs:
        """What is left to do: unfinished tests, and the plays they need.

        Args:
            resume: continue interrupted recordings instead of starting over.
            overwrite: replace files that do not fit the experiment, or would not.

        Raises:
            ExperimentError: files do not fit the experiment, and must not be overwritten.
        """
        repeats = [(cell, seed) for cell in self._spec.cells for seed in self._spec.seeds(cell)]
        tests = [job for repeat in repeats for job in self.scorings(*repeat)]
        scorings = self._unfinished(tests)
        needed = {job.play for job in scorings}
        jobs = [self.play(*repeat) for repeat in repeats]
        plays = {job.name: job for job in jobs if job and job.name in needed}
        to_play = self._unfinished(list(plays.values()))
        if not overwrite:
            self._check_belonging([*tests, *plays.values()])
        left, replayed = {job.name for job in scorings}, {job.name for job in to_play}
        outdated = [job for job in tests if job.name not in left and job.play in replayed]
        played = [
            job.model_copy(update={"resume": resume and not self.state(job).mismatches})
            for job in to_play
        ]
        if overwrite:
            return PendingJobs(tuple(played), (*scorings, *outdated))
        return PendingJobs(tuple(played), tuple(scorings), tuple(outdated))

    def _shared_fields(
        self, name: str, player: Cell | Play, objects: int, seed: int, suffix: str
    ) -> dict[str, Any]:
        """What plays and tests share."""
        return {
            "name": name,
            "controller": self._spec.controller(player.controller),
            "condition": player.condition,
            "objects": objects,
            "scene": self._spec.scene_source,
            "scene_name": self._scene_name,
            "seed": seed,
            "settings": player.settings,
            "out": self._spec.results_folder / f"{name}{suffix}",
            "isolate": self._isolate,
            "limits": self._limits,
        }

    def _unfinished(self, jobs: Sequence[_T]) -> list[_T]:
        """What is not done yet, or must be done again."""
        states = [(job, self.state(job)) for job in jobs]
        return [job for job, state in states if not state.is_done]

    def _check_belonging(self, jobs: Sequence[Job]) -> None:
        """Raise ExperimentError for files that do not fit, all at once."""
        states = [(job, self.state(job)) for job in jobs]
        wrong = [
            mismatch_message(job.out, state.mismatches) for job, state in states if state.mismatches
        ]
        if wrong:
            raise mismatch_error(wrong, "give the cell another name to keep both, ")

    @cached_property
    def _scene_name(self) -> str:
        from real_bench.simulation.scene import manifest_path, read_manifest

        return read_manifest(manifest_path(self._spec.scene_source)).name
