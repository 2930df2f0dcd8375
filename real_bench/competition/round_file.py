"""What a round was, kept among its results: all that a leaderboard says of it."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from real_bench.competition.spec import Competition
from real_bench.errors import ExperimentError, faults
from real_bench.files import write_whole
from real_bench.goal_sets import GoalSet

FILE = "round.json"


class RoundFacts(BaseModel):
    """A round; see :class:`real_bench.competition.spec.Round`.

    Attributes:
        title: of the competition.
        name: of the round.
        goals: where the goal set was.
        goals_sha256, n_goals: of its content.
        hidden: whether nothing of the goals may be shown.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

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

    def save(self, folder: Path) -> None:
        """Keep it in the round's folder; it appears whole."""
        text = json.dumps(self.model_dump(mode="json"), indent=1, ensure_ascii=False)
        write_whole(folder / FILE, f"{text}\n".encode())


def load_round(folder: Path) -> RoundFacts:
    """What a round's folder says of it; raises ExperimentError."""
    path = folder / FILE
    if not path.is_file():
        raise ExperimentError(f"{folder} holds no round: there is no {FILE}")
    try:
        return RoundFacts.model_validate_json(path.read_text(encoding="utf-8"))
    except (ValidationError, UnicodeDecodeError) as error:
        reason = faults(error, 3) if isinstance(error, ValidationError) else error
        raise ExperimentError(f"{path} is damaged: {reason}") from error
