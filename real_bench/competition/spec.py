"""The rounds of a competition, as the organisers describe them in one YAML file."""

from __future__ import annotations

from datetime import datetime, timezone
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    StringConstraints,
    ValidationError,
    field_validator,
    model_validator,
)

from real_bench.controller_code.manifest import FROZEN
from real_bench.errors import ExperimentError, RealBenchError, faults
from real_bench.fields import ConditionName, Name, Seed, SpecFile, Steps, TrialSteps
from real_bench.inputs.records import Record
from real_bench.inputs.spelling import spelled
from real_bench.inputs.yaml_files import read_mapping
from real_bench.lengths import INTRINSIC_STEPS, LARGEST, TRIAL_STEPS
from real_bench.sandbox.limits import Limits
from real_bench.text.nearest import unknown_name_hint

MOMENT = "%Y-%m-%d %H:%M:%S"

Commitment = Annotated[
    str,
    StringConstraints(strip_whitespace=True, to_lower=True),
    spelled(
        "([0-9a-f]{64})?",
        "`realbench goals generate --secret` prints 64 hexadecimal digits: give all of them",
    ),
]

Play = Literal["own", "given", "none"]


class Round(Record):
    """A round: what every submission goes through.

    Attributes:
        condition, objects: of play and test.
        goals: the goal set's file.
        released: whether secret goals have been opened and may be shown.
        commitment: of secret goals, shown beside the scores; empty: there is none.
        play: ``own``: each submission plays itself; ``given``: all learn from ``recordings``;
            ``none``: they are tested as they are.
        recordings: files, one per repeat; only with ``play: given``.
        steps: how long a play lasts.
        trial_steps: how long a trial lasts.
        repeats: how many plays each submission makes or learns from.
        seed: of the first of them; those of the others follow.
        limits: what a submission may use up, in each play and each test.
        failure: how a failed submission counts: ``zero``, or ``excluded``.
        ties: ``paired``: submissions share a rank if the paired comparison cannot tell them from
            the first of them; ``none``: the mean alone decides.
        start, end: when a platform takes submissions, e.g. ``2027-01-31 12:00:00`` (UTC). Here
            whoever holds the round decides what came in time.
    """

    condition: ConditionName = "IM"
    objects: Annotated[int, Field(ge=1)] = 1
    goals: str
    released: bool = False
    commitment: Commitment = ""
    play: Play = "own"
    recordings: tuple[str, ...] = ()
    steps: Steps = INTRINSIC_STEPS
    trial_steps: TrialSteps = TRIAL_STEPS
    repeats: Annotated[int, Field(ge=1)] = 1
    seed: Seed = 0
    limits: Limits = Field(default_factory=Limits)
    failure: Literal["zero", "excluded"] = "excluded"
    ties: Literal["paired", "none"] = "paired"
    start: str = ""
    end: str = ""

    @field_validator("start", "end")
    @classmethod
    def _check_moment(cls, text: str) -> str:
        """A moment as it is always written, so that moments can be compared as text."""
        if not text:
            return text
        try:
            return datetime.strptime(text, MOMENT).isoformat(sep=" ")
        except ValueError as error:
            raise ValueError("write it like 2027-01-31 12:00:00") from error

    @model_validator(mode="after")
    def _check_end(self) -> Round:
        if self.start and self.end and self.end <= self.start:
            raise ValueError(f"it ends ({self.end}) before it starts ({self.start})")
        return self

    @field_validator("limits", mode="before")
    @classmethod
    def _parse_limits(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        try:
            return Limits(**{name: float(value) for name, value in values.items()})
        except (RealBenchError, TypeError, ValueError) as error:
            raise ValueError(f"{error} (memory_gib, call_s, total_s)") from error

    @model_validator(mode="after")
    def _check_recordings(self) -> Round:
        if (self.play == "given") != bool(self.recordings):
            raise ValueError("recordings go with `play: given`, and only with it")
        if self.play == "given" and self.repeats not in (1, len(self.recordings)):
            raise ValueError("each recording is one repeat: leave repeats out")
        return self

    @model_validator(mode="after")
    def _check_seeds(self) -> Round:
        if self.seeds[-1] > LARGEST:
            raise ValueError("it has seeds of 2**63 or more")
        return self

    @property
    def seeds(self) -> range:
        """The seed of each repeat."""
        return range(self.seed, self.seed + (len(self.recordings) or self.repeats))

    @property
    def is_over(self) -> bool:
        """Whether its end, if it has one, has passed."""
        now = datetime.now(timezone.utc).replace(tzinfo=None)
        return bool(self.end) and now > datetime.fromisoformat(self.end)


class Competition(SpecFile):
    """The rounds of a competition.

    Attributes:
        folder: of the file that describes it; paths in it are relative to this.
        title: shown above leaderboards.
        scene: name or manifest.
        results: folder of all results.
        rounds: by name, in their order.
    """

    results: Path = Path("results")
    scene: str = "official"
    rounds: Annotated[dict[Name, Round], Field(min_length=1)]

    @field_validator("rounds")
    @classmethod
    def _check_names(cls, rounds: dict[str, Round]) -> dict[str, Round]:
        """Each round has a folder in the results, beside that of the submissions."""
        if taken := [name for name in rounds if name.casefold() == FROZEN]:
            raise ValueError(
                f"a round cannot be called {taken[0]}: the results keep all submissions in a "
                "folder of that name"
            )
        return rounds

    @property
    def scene_source(self) -> str:
        """What the scene is found by, from anywhere."""
        return self.resolve_scene(self.scene)

    def goals(self, name: str) -> Path:
        """The goal set of a round."""
        return self.folder / self.rounds[name].goals

    def recordings(self, name: str) -> list[Path]:
        """The recordings of a round, if given."""
        return [self.folder / file for file in self.rounds[name].recordings]


def read_competition(path: Path) -> Competition:
    """Read the file of a competition; raises ExperimentError with every fault at once."""
    values = read_mapping(path, "the file of rounds", ExperimentError)
    try:
        return Competition.model_validate(
            {"title": path.stem, **values, "folder": path.resolve().parent}
        )
    except ValidationError as error:
        found = faults(error, unknown=unknown_name_hint(Competition, {"folder"}))
        raise ExperimentError(f"{path} is not valid: {found}") from error
