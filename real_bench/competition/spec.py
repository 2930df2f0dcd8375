"""What the organisers say: the rounds of a competition, in one YAML file."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from real_bench.errors import ExperimentError, RealBenchError, faults
from real_bench.fields import ConditionName, Described, Name, Record, Seed, Steps
from real_bench.lengths import INTRINSIC_STEPS, TRIAL_STEPS
from real_bench.nearest import what_there_is
from real_bench.sandbox.limits import Limits
from real_bench.yaml_files import read_mapping

MOMENT = "%Y-%m-%d %H:%M:%S"


class Round(Record):
    """A round: what every submission has to go through.

    Attributes:
        condition, objects: of play and test.
        goals: the goal set's file.
        released: whether secret goals may be shown, since they were opened.
        commitment: of secret goals, to be shown beside the scores; empty: there is none.
        play: ``own``: each submission plays itself; ``given``: all learn from ``recordings``;
            ``none``: they are tested as they are.
        recordings: files, one a repeat; only where play is given.
        steps, trial_steps: how long a play, and a trial, lasts.
        repeats, seed: how many plays, with seeds from this one on.
        limits: what a submission may use up, in each play and each test.
        failure: what one counts that failed: ``zero``, or ``excluded``.
        ties: ``paired``: those share a rank whom the paired comparison with the first of them
            cannot tell apart; ``none``: the mean alone decides.
        start, end: when a platform takes submissions, as in ``2027-01-31 12:00:00`` (UTC).
    """

    condition: ConditionName = "IM"
    objects: Annotated[int, Field(ge=1)] = 1
    goals: str
    released: bool = False
    commitment: str = ""
    play: Literal["own", "given", "none"] = "own"
    recordings: tuple[str, ...] = ()
    steps: Steps = INTRINSIC_STEPS
    trial_steps: Steps = TRIAL_STEPS
    repeats: Annotated[int, Field(ge=1)] = 1
    seed: Seed = 0
    limits: Limits = Field(default_factory=Limits)
    failure: Literal["zero", "excluded"] = "excluded"
    ties: Literal["paired", "none"] = "paired"
    start: str = ""
    end: str = ""

    @field_validator("start", "end")
    @classmethod
    def _is_a_moment(cls, text: str) -> str:
        if text:
            try:
                datetime.strptime(text, MOMENT)
            except ValueError as error:
                raise ValueError("write it as 2027-01-31 12:00:00") from error
        return text

    @field_validator("limits", mode="before")
    @classmethod
    def _limits_are_possible(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        try:
            return Limits(**{name: float(value) for name, value in values.items()})
        except (RealBenchError, TypeError, ValueError) as error:
            raise ValueError(f"{error} (memory_gib, call_s, total_s)") from error

    @model_validator(mode="after")
    def _recordings_fit(self) -> Round:
        if (self.play == "given") != bool(self.recordings):
            raise ValueError("recordings are named where, and only where, play is given")
        if self.play == "given" and self.repeats not in (1, len(self.recordings)):
            raise ValueError("there are as many repeats as recordings: leave repeats out")
        return self

    @property
    def seeds(self) -> range:
        """The seed of each repeat."""
        return range(self.seed, self.seed + (len(self.recordings) or self.repeats))


class Competition(Described):
    """Rounds, and where they are held.

    Attributes:
        folder: of the file that describes it; paths in it are relative to this.
        title: above leaderboards.
        scene: name or manifest.
        results: folder of all that comes of it.
        rounds: by name, in their order.
    """

    results: Path = Path("results")
    scene: str = "official"
    rounds: Annotated[dict[Name, Round], Field(min_length=1)]

    @property
    def scene_source(self) -> str:
        """What the scene is found by, from anywhere."""
        return self.scene_found_by(self.scene)

    def goals(self, name: str) -> Path:
        """The goal set of a round."""
        return self.folder / self.rounds[name].goals

    def recordings(self, name: str) -> list[Path]:
        """What is learned from in a round, where it is given."""
        return [self.folder / file for file in self.rounds[name].recordings]


def read_competition(path: Path) -> Competition:
    """Read the file of a competition; raises ExperimentError with every fault at once."""
    values = read_mapping(path, "the file of rounds", ExperimentError)
    try:
        return Competition.model_validate(
            {"title": path.stem, **values, "folder": path.resolve().parent}
        )
    except ValidationError as error:
        found = faults(error, unknown=what_there_is(Competition, {"folder"}))
        raise ExperimentError(f"{path} is not valid: {found}") from error
