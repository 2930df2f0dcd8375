"""The facts of a round, kept among its results for the leaderboard."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any, ClassVar

from real_bench.competition.kept import KeptRecord
from real_bench.competition.spec import Competition
from real_bench.errors import ExperimentError
from real_bench.goal_sets import GoalSet


class RoundFacts(KeptRecord):
    """A round; see :class:`real_bench.competition.spec.Round`.

    Attributes:
        title: of the competition.
        name: of the round.
        goals: where the goal set was.
        goals_sha256, n_goals: of its content.
        hidden: whether the goals must not be shown.
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
    limits: dict[str, float]
    failure: str
    ties: str
    goals: str
    goals_sha256: str
    n_goals: int
    hidden: bool
    commitment: str

    @classmethod
    def of(cls, competition: Competition, name: str, goals: GoalSet) -> RoundFacts:
        """The facts of a round."""
        chosen = competition.rounds[name]
        facts: dict[str, Any] = {
            field: getattr(chosen, field)
            for field in (
                *("condition", "objects", "play", "steps", "trial_steps"),
                *("failure", "ties", "commitment"),
            )
        }
        return cls(
            title=competition.title,
            name=name,
            scene=competition.scene_source,
            repeats=len(chosen.seeds),
            limits=asdict(chosen.limits),
            goals=str(competition.goals(name).resolve()),
            goals_sha256=goals.sha256,
            n_goals=len(goals),
            hidden=goals.is_secret and not chosen.released,
            **facts,
        )


def load_round(folder: Path) -> RoundFacts:
    """What a round's folder says of it; raises ExperimentError."""
    facts = RoundFacts.load(folder)
    if facts is None:
        raise ExperimentError(f"{folder} holds no round: it has no {RoundFacts.FILE}")
    return facts
