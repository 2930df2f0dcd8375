"""The result file of an extrinsic phase: JSON, written anew as each trial ends."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from real_bench.errors import ResultError, faults
from real_bench.files import write_whole
from real_bench.goal_sets.goal import CHALLENGES
from real_bench.scoring.commands import Commands
from real_bench.scoring.metric import object_scores
from real_bench.scoring.result_file import (
    FORMAT,
    SEAL,
    TIMING,
    WITH_COMMANDS,
    WITHOUT_COMMANDS,
    Content,
    check_writable,
    is_sealed,
    read_content,
    sealed,
)
from real_bench.scoring.summary import ClassSummary, GoalOutcome, summarise

Pose = Annotated[tuple[float, ...], Field(min_length=7, max_length=7)]


def _one_line(text: str) -> str:
    if not text.isprintable():
        raise ValueError("a name must be of letters that can be printed")
    return text


Line = Annotated[str, AfterValidator(_one_line)]
"""Is printed as it is: a stranger's file must not move the cursor of a terminal."""


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Setting(_Record):
    """What was tested, and with what: everything that decides the scores.

    Attributes:
        condition, objects, object_names, scene, scene_sha256: of the test.
        controller, controller_sha256: as named by the user; hash of its file.
        settings: of the controller, whole; empty where it has none.
        run_sha256, run_steps: hash and length of the recording it learned from; empty, 0 if none.
        goals_sha256: hash of the goal set's content.
        n_goals: how many trials are asked for.
        trial_steps: length of a trial.
        seed: of the test.
        versions: of Python and the packages that can change the outcome, and the physics.
    """

    condition: Line
    objects: int
    object_names: tuple[Line, ...]
    scene: Line
    scene_sha256: str
    controller: Line
    controller_sha256: str
    settings: dict[str, Any] = Field(default_factory=dict)
    run_sha256: str
    run_steps: int
    goals_sha256: str
    n_goals: int
    trial_steps: int
    seed: int
    versions: dict[Line, Line]


class TrialResult(_Record):
    """One trial.

    Attributes:
        goal: its number in the goal set, from 0.
        challenge: its class.
        score: M_g.
        distances: of each object to its goal, metres.
        final_poses: where the objects ended, position and quaternion each.
        actions_sha256: hash of every command that was executed.
        commands: these commands; None in a result made before they were kept.
    """

    goal: int
    challenge: str
    score: float
    distances: tuple[float, ...]
    final_poses: tuple[Pose, ...]
    actions_sha256: str
    commands: Commands | None = None

    @model_validator(mode="after")
    def _hash_is_that_of_the_commands(self) -> TrialResult:
        if self.commands is not None and self.commands.sha256 != self.actions_sha256:
            raise ValueError("actions_sha256 is not that of the commands")
        return self

    @model_validator(mode="after")
    def _score_is_that_of_the_distances(self) -> TrialResult:
        if self.challenge not in CHALLENGES:
            raise ValueError(f"challenge {self.challenge!r} is none of {', '.join(CHALLENGES)}")
        if min(self.distances, default=-1.0) < 0 or len(self.final_poses) != len(self.distances):
            raise ValueError("each object needs its distance, 0 or more, and its final pose")
        if not _same(self.score, float(object_scores(self.distances).sum())):
            raise ValueError(f"score {self.score} is not that of distances {self.distances}")
        return self

    def outcome(self) -> GoalOutcome:
        """What the statistics need of it."""
        return GoalOutcome(self.challenge, self.score, self.distances)


class Result(_Record):
    """An extrinsic phase, finished or not.

    Attributes:
        setting: what was tested.
        trials: in the order of their goals.
        seconds: wall time of each trial, by goal number: all that differs when it is repeated.
    """

    setting: Setting
    trials: tuple[TrialResult, ...] = ()
    seconds: dict[int, float] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _trials_are_of_this_test(self) -> Result:
        numbers = [trial.goal for trial in self.trials]
        if len(set(numbers)) < len(numbers) or numbers != sorted(numbers):
            raise ValueError("trials must be in order, each goal once")
        if numbers and not (numbers[0] >= 0 and numbers[-1] < self.setting.n_goals):
            raise ValueError(f"a trial's goal is not below {self.setting.n_goals}")
        if any(len(trial.distances) != self.setting.objects for trial in self.trials):
            raise ValueError(f"trials must be of {self.setting.objects} object(s)")
        return self

    @model_validator(mode="after")
    def _commands_are_of_these_trials(self) -> Result:
        commands = [trial.commands for trial in self.trials if trial.commands is not None]
        if len(commands) not in (0, len(self.trials)):
            raise ValueError("all trials keep their commands, or none does")
        if any(kept.n_steps != self.setting.trial_steps for kept in commands):
            raise ValueError(f"the commands of a trial must last {self.setting.trial_steps} steps")
        return self

    def with_trial(self, trial: TrialResult, seconds: float) -> Result:
        """The result with one more trial."""
        trials = sorted([*self.trials, trial], key=lambda trial: trial.goal)
        times = dict(sorted({**self.seconds, trial.goal: seconds}.items()))
        return self.model_copy(update={"trials": tuple(trials), "seconds": times})

    @property
    def keeps_commands(self) -> bool:
        """Whether its trials can be replayed."""
        return all(trial.commands is not None for trial in self.trials)

    @property
    def version(self) -> int:
        """Of the file that holds it."""
        return WITH_COMMANDS if self.keeps_commands else WITHOUT_COMMANDS

    @property
    def is_complete(self) -> bool:
        """Whether every trial has been made."""
        return len(self.trials) == self.setting.n_goals

    @property
    def score(self) -> float:
        """M: the mean over the goals tested so far; raises ResultError where there is none."""
        return self.summary()[-1].score

    def summary(self) -> list[ClassSummary]:
        """By class, the total last."""
        if not self.trials:
            raise ResultError("the result has no trial yet")
        return summarise([trial.outcome() for trial in self.trials])

    def to_json(self) -> Content:
        """The file's content: setting, trials, summary, the seal, and what time it took."""
        fields = self.model_dump(mode="json")
        content = {
            "format": FORMAT,
            "version": self.version,
            "setting": fields["setting"],
            "trials": [_without_none(trial) for trial in fields["trials"]],
            "complete": self.is_complete,
            "summary": [asdict(row) for row in self.summary()] if self.trials else [],
            TIMING: {"seconds": fields["seconds"]},
        }
        return sealed(content) if self.keeps_commands else content

    def save(self, path: Path) -> None:
        """Write the file; it appears whole. Raises ResultError where it would be too large."""
        text = (json.dumps(self.to_json(), indent=1) + "\n").encode()
        check_writable(path, text)
        write_whole(path, text)


def load_result(path: Path) -> Result:
    """Read a result file.

    Raises:
        ResultError: it does not exist, is not a result, contradicts itself, was altered after it
            was sealed, or was written by a newer version.
    """
    content = read_content(path)
    result = parse_content(content, path)
    if not is_sealed(content):
        raise ResultError(f"{path} was altered: its seal is not that of its content")
    return result


def parse_content(content: Content, path: Path) -> Result:
    """The result of a file's content, whether or not its seal holds; raises ResultError."""
    try:
        result = _parse(content)
    except ValidationError as error:
        raise ResultError(f"{path} is damaged: {faults(error, 3)}") from error
    if not _agrees(content, result):
        raise ResultError(f"{path} is damaged: its summary is not that of its trials")
    return result


def _agrees(fields: Content, result: Result) -> bool:
    """Whether what a file says beside its trials follows from them.

    Intervals do not count: another version of numpy may draw other resamples.
    """
    told, true = fields.get("summary"), result.summary() if result.trials else []
    return (
        fields.get("complete") is result.is_complete
        and fields["version"] == result.version
        and isinstance(told, list)
        and len(told) == len(true)
        and all(map(_same_row, told, map(asdict, true)))
    )


def _same_row(told: Any, true: dict[str, Any]) -> bool:
    return (
        isinstance(told, dict)
        and told.keys() == true.keys()
        and (told["name"], told["n_goals"]) == (true["name"], true["n_goals"])
        and all(_same(told[key], true[key]) for key in ("score", "distance"))
    )


def _without_none(fields: Content) -> Content:
    return {key: value for key, value in fields.items() if value is not None}


def _same(a: Any, b: Any) -> bool:
    """Whether two numbers agree but for rounding, which may differ between machines."""
    numbers = isinstance(a, int | float) and isinstance(b, int | float)
    return numbers and math.isclose(a, b, rel_tol=1e-9)


def _parse(fields: Content) -> Result:
    """The result of a file's content; what follows from the rest is left out."""
    derived = ("format", "version", "complete", "summary", TIMING, SEAL)
    kept = {key: fields[key] for key in fields if key not in derived}
    timing = fields.get(TIMING)
    seconds = timing.get("seconds") if isinstance(timing, dict) else None
    return Result.model_validate({**kept, "seconds": seconds})
