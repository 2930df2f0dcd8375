"""The facts of a round, kept among its results for the leaderboard."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field

from real_bench.competition.kept import KeptRecord
from real_bench.competition.spec import Competition
from real_bench.errors import ExperimentError
from real_bench.goal_sets import GoalSet
from real_bench.sandbox.limits import Limits
from real_bench.scoring.result import Result
from real_bench.simulation import Scene


class RoundFacts(KeptRecord):
    """A round; see :class:`real_bench.competition.spec.Round`.

    Attributes:
        title: of the competition.
        name: of the round.
        goals: where the goal set was.
        goals_sha256, n_goals: of its content.
        hidden: whether the goals must not be shown.
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
        current: Mapping[str, str],
    ) -> RoundFacts:
        """The facts of a round, with the current version of each submission."""
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
            scene_sha256=scene.sha256,
            recordings=tuple(recordings),
            repeats=len(chosen.seeds),
            seeds=tuple(chosen.seeds),
            current=dict(current),
            goals=str(competition.goals(name).resolve()),
            goals_sha256=goals.sha256,
            n_goals=len(goals),
            hidden=goals.is_secret and not chosen.released,
            **facts,
        )

    def includes(self, result: Result) -> bool:
        """Whether a result is one of this round, as it is now."""
        setting = result.setting
        expected = {
            "condition": self.condition,
            "objects": self.objects,
            "goals_sha256": self.goals_sha256,
            "trial_steps": self.trial_steps,
        }
        if self.play == "own":
            expected["run_steps"] = self.steps
        if self.scene_sha256:
            expected["scene_sha256"] = self.scene_sha256
        if self.seeds and setting.seed not in self.seeds:
            return False
        if self.recordings and setting.run_sha256 not in self.recordings:
            return False
        return all(getattr(setting, name) == value for name, value in expected.items())


def result_name(seed: int) -> str:
    """The file of a repeat's result, in a submission's folder."""
    return f"seed{seed}.json"


def load_round(folder: Path) -> RoundFacts:
    """What a round's folder says of it; raises ExperimentError."""
    facts = RoundFacts.load(folder)
    if facts is None:
        raise ExperimentError(f"{folder} holds no round: it has no {RoundFacts.FILE}")
    return facts
