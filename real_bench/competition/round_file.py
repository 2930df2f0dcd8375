"""The facts of a round, kept among its results for the leaderboard."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field

from real_bench.competition.kept import KeptRecord
from real_bench.competition.spec import Competition
from real_bench.competition.standing import WAITING, Standing
from real_bench.conditions import Condition
from real_bench.errors import ExperimentError
from real_bench.goal_sets import GoalSet
from real_bench.sandbox.limits import Limits
from real_bench.scoring.result import Result
from real_bench.simulation import Scene

PLAY, TEST = "play", "test"
NOT_OF_THIS_ROUND = "it was not tested in this round as it is now"


class RoundFacts(KeptRecord):
    """A round; see :class:`real_bench.competition.spec.Round`.

    Attributes:
        title: of the competition.
        name: of the round.
        goals: where the goal set was.
        goals_sha256, n_goals: of its content.
        hidden: whether the goals must not be shown.
        control_version: of the way of control; 0 in files of old.
        scene_sha256: of the scene; empty in files of old.
        recordings: hashes of those to learn from, if they are given; none in files of old.
        seeds: of its repeats; none in files of old, where all results count.
        current: by the key of each submission, the version of it that was handed in last; a
            withdrawn one keeps its last.
    """

    FILE: ClassVar[str] = "round.json"

    title: str
    name: str
    condition: str
    objects: int
    scene: str
    play: str
    steps: int
    trial_steps: int
    repeats: int
    limits: Limits
    failure: str
    ties: str
    goals: str
    goals_sha256: str
    n_goals: int
    hidden: bool
    commitment: str
    control_version: int = 0
    scene_sha256: str = ""
    recordings: tuple[str, ...] = ()
    seeds: tuple[int, ...] = ()
    current: dict[str, str] = Field(default_factory=dict)

    @classmethod
    def of(
        cls,
        competition: Competition,
        name: str,
        goals: GoalSet,
        scene: Scene,
        recordings: Sequence[str],
    ) -> RoundFacts:
        """The facts of a round, without its submissions."""
        chosen = competition.rounds[name]
        facts: dict[str, Any] = {
            field: getattr(chosen, field)
            for field in (
                *("condition", "objects", "play", "steps", "trial_steps"),
                *("limits", "failure", "ties", "commitment"),
            )
        }
        return cls(
            title=competition.title,
            name=name,
            scene=competition.scene_source,
            control_version=Condition.parse(chosen.condition).control_version,
            scene_sha256=scene.sha256,
            recordings=tuple(recordings),
            repeats=len(chosen.seeds),
            seeds=tuple(chosen.seeds),
            goals=str(competition.goals(name).resolve()),
            goals_sha256=goals.sha256,
            n_goals=len(goals),
            hidden=goals.is_secret and not chosen.released,
            **facts,
        )

    @property
    def task_sha256(self) -> str:
        """A hash of what each submission must do, but for seeds and limits."""
        names = {*("condition", "objects", "control_version", "scene_sha256", "play", "steps")}
        names |= {"trial_steps", "goals_sha256", "recordings"}
        facts = self.model_dump(mode="json", include=names)
        return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()

    def without_old_failures(self, standing: Standing) -> Standing:
        """A standing by the failures that are of this round as it is now; waiting if by none."""
        kinds = (PLAY, TEST) if self.play == "own" else (TEST,)
        jobs = {job_name(standing.key, kind, seed) for kind in kinds for seed in self.seeds}
        failures = {
            name: failed
            for name, failed in standing.failures.items()
            if (name in jobs or not self.seeds) and failed.task_sha256 in ("", self.task_sha256)
        }
        if failures == standing.failures:
            return standing
        if failures:
            return standing.with_failures(failures)
        changes = {"status": WAITING, "detail": NOT_OF_THIS_ROUND, "failures": {}, "seconds": 0.0}
        return standing.model_copy(update=changes)

    def shown(self, standing: Standing) -> Standing:
        """A standing as others than the organisers may see it."""
        return standing.without_reasons() if self.hidden else standing

    def includes(self, result: Result) -> bool:
        """Whether a result is a whole one of this round, as it is now."""
        setting = result.setting
        expected = {
            "condition": self.condition,
            "objects": self.objects,
            "goals_sha256": self.goals_sha256,
            "trial_steps": self.trial_steps,
        }
        if self.play == "own":
            expected["run_steps"] = self.steps
        if self.play == "none":
            expected["run_steps"] = 0
        if self.control_version:
            expected["control_version"] = self.control_version
        if self.scene_sha256:
            expected["scene_sha256"] = self.scene_sha256
        if self.seeds and setting.seed not in self.seeds:
            return False
        if self.recordings and setting.run_sha256 not in self.recordings:
            return False
        if (self.play == "none") == bool(setting.run_sha256):
            return False
        if len(result.trials) != self.n_goals:
            return False
        return all(getattr(setting, name) == value for name, value in expected.items())


def job_name(key: str, kind: str, seed: int) -> str:
    """The name of a repeat's play or test, of a submission."""
    return f"{key}-{kind}{seed}"


def result_name(seed: int) -> str:
    """The file of a repeat's result, in a submission's folder."""
    return f"seed{seed}.json"


def load_round(folder: Path) -> RoundFacts:
    """What a round's folder says of it; raises ExperimentError."""
    facts = RoundFacts.load(folder)
    if facts is None:
        raise ExperimentError(f"{folder} holds no round: it has no {RoundFacts.FILE}")
    return facts
