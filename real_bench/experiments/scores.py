"""The scores of an experiment so far."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from real_bench.conditions import Condition
from real_bench.errors import ExperimentError
from real_bench.experiments.job_state import mismatch_error, mismatch_message
from real_bench.experiments.jobs import ScoringJob
from real_bench.experiments.plan import ExperimentPlan
from real_bench.experiments.spec import Cell, Spec
from real_bench.goal_sets import OFFICIAL_COUNTS
from real_bench.lengths import INTRINSIC_STEPS, TRIAL_STEPS
from real_bench.physics import physics_of
from real_bench.scoring.one_test import sources_of
from real_bench.scoring.repeats import RepeatsSummary, by_goal, summarise_repeats
from real_bench.scoring.result import Result
from real_bench.simulation import DEFAULT_SCENE
from real_bench.text.naming import scene_name, shareable_name


@dataclass(frozen=True)
class Row:
    """A cell and its scores so far.

    Attributes:
        cell: what was asked for.
        n_asked: how many repeats.
        seeds: of the repeats that are done.
        files: their results.
        control_version: of the way of control in these; None while there are none.
        summary: of their scores; None while there are none.
        unlike_published: what differs from how the published score was made.
        physics: of each of the results.
        sources: the hash of realbench's own code of each of the results.
        name: of a submission; empty if it is called by the cell's label.
    """

    cell: Cell
    n_asked: int
    seeds: tuple[int, ...]
    files: tuple[Path, ...]
    control_version: int | None
    summary: RepeatsSummary | None
    unlike_published: tuple[str, ...] = ()
    physics: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()
    name: str = ""

    @property
    def label(self) -> str:
        """What it is called."""
        return self.name or self.cell.label

    @property
    def difference(self) -> float | None:
        """Our mean minus the published one."""
        if self.summary is None or self.cell.published is None:
            return None
        return self.summary.score.mean - self.cell.published.mean

    @property
    def is_of_earlier_control(self) -> bool:
        """Whether the robot was moved by an earlier version of the way of control."""
        now = Condition.parse(self.cell.condition).control_version
        return self.control_version not in (None, now)

    @property
    def is_enough(self) -> bool:
        """Whether there are enough plays to compare their mean with another."""
        return self.summary is not None and self.summary.is_enough

    def to_json(self) -> dict[str, Any]:
        """All of it; files by name."""
        return {
            **self.cell.model_dump(mode="json"),
            "controller": shareable_name(self.cell.controller),
            "repeats": self.n_asked,
            "seeds_done": list(self.seeds),
            "files": [file.name for file in self.files],
            "control_version": self.control_version,
            "earlier_control": self.is_of_earlier_control,
            "summary": self.summary.to_json() if self.summary else None,
            "difference": self.difference,
            "physics": sorted(set(self.physics)),
            "sources": sorted(set(self.sources)),
            "enough_repeats_to_compare": self.is_enough,
            "unlike_published": list(self.unlike_published),
        }


def rows_of(spec: Spec, plan: ExperimentPlan) -> list[Row]:
    """One row per cell.

    A table holds only results with the same scene, goals, lengths and settings; a repeat counts
    once all of its goal sets are tested.

    Raises:
        ExperimentError: results do not fit the experiment, or one another.
    """
    plan.goals.check()
    consistency = _ConsistencyCheck()
    return [_row(spec, plan, cell, consistency) for cell in spec.cells]


def _row(spec: Spec, plan: ExperimentPlan, cell: Cell, consistency: _ConsistencyCheck) -> Row:
    seeds: list[int] = []
    files: list[Path] = []
    results: list[Result] = []
    for seed in spec.seeds(cell):
        repeat = list(_finished(plan, plan.scorings(cell, seed)))
        if len(repeat) < len(spec.goal_names(cell)):
            continue
        for job, result in repeat:
            consistency.check(cell, job, result)
        results += [result for _, result in repeat]
        seeds.append(seed)
        files += [job.out for job, _ in repeat]
    table = by_goal(results) if results else None
    summary = summarise_repeats(table) if table else None
    version = results[0].setting.control_version if results else None  # all are alike
    unlike = tuple(_differences_from_published(spec, cell, table.classes if table else ()))
    return Row(
        cell=cell,
        n_asked=len(spec.seeds(cell)),
        seeds=tuple(seeds),
        files=tuple(files),
        control_version=version,
        summary=summary,
        unlike_published=unlike,
        physics=tuple(physics_of(result.setting.versions) for result in results),
        sources=sources_of(results),
        name=spec.submission_name(cell),
    )


def _differences_from_published(spec: Spec, cell: Cell, classes: Sequence[str]) -> Iterator[str]:
    """Lengths and goals of an experiment that differ from the benchmark's."""
    if cell.published is None:
        return
    whole = sum(OFFICIAL_COUNTS.values())
    if any(classes.count(name) * whole != n * len(classes) for name, n in OFFICIAL_COUNTS.items()):
        counts = ", ".join(f"{n} {name}" for name, n in OFFICIAL_COUNTS.items())
        yield f"goals in other proportions than {counts}"
    if spec.scene != DEFAULT_SCENE:
        yield f"scene {scene_name(spec.scene)} instead of {DEFAULT_SCENE}"
    if spec.play_of(cell) and spec.steps != INTRINSIC_STEPS:
        yield f"{spec.steps:,} steps of play instead of {INTRINSIC_STEPS:,}"
    if spec.trial_steps != TRIAL_STEPS:
        yield f"trials of {spec.trial_steps:,} steps instead of {TRIAL_STEPS:,}"


def _finished(
    plan: ExperimentPlan, jobs: Sequence[ScoringJob]
) -> Iterator[tuple[ScoringJob, Result]]:
    for job in jobs:
        state = plan.state(job)
        if state.mismatches:
            raise mismatch_error([mismatch_message(job.out, state.mismatches)])
        if state.result and state.is_done:
            yield job, state.result


class _ConsistencyCheck:
    """Remembers what results were made with, and refuses those that do not fit the others."""

    def __init__(self) -> None:
        self._seen: dict[tuple[str, ...], tuple[Any, Path]] = {}

    def check(self, cell: Cell, job: ScoringJob, result: Result) -> None:
        """Raise ExperimentError if a result has another scene, goals or settings."""
        setting = result.setting
        self._require_same(job, setting.scene_sha256, "scenes")
        self._require_same(job, setting.goals_sha256, "goals", job.goals.name)
        self._require_same(job, setting.control_version, "versions of its control", cell.name)
        self._require_same(job, setting.settings, "settings", cell.name)
        if setting.learned:  # older results do not say
            learned = setting.learned.settings
            self._require_same(job, learned, "settings that learned", cell.name)

    def _require_same(self, job: ScoringJob, value: Any, what: str, *of: str) -> None:
        first, file = self._seen.setdefault((what, *of), (value, job.out))
        if value != first:
            raise ExperimentError(
                f"{job.out.name} and {file.name} have different {what}, which are never averaged"
            )
