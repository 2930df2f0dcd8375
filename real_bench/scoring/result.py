"""The result file of an extrinsic phase: JSON, rewritten after each trial."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, ValidationError, model_validator

from real_bench.errors import ResultError, faults
from real_bench.files.atomic import write_atomically
from real_bench.goal_sets.goal import CHALLENGES
from real_bench.inputs.records import Record
from real_bench.scoring.commands import Commands
from real_bench.scoring.metric import object_scores
from real_bench.scoring.older import upgrade
from real_bench.scoring.result_file import (
    FORMAT,
    SEAL,
    TIMING,
    VERSION,
    Content,
    check_writable,
    is_sealed,
    read_content,
    sealed,
)
from real_bench.text.counting import counted
from real_bench.text.quoting import quoted

Pose = Annotated[tuple[float, ...], Field(min_length=7, max_length=7)]


def _check_printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("a name must be printable")
    return text


Line = Annotated[str, AfterValidator(_check_printable)]
"""Printed as it is, so a stranger's file must not move the cursor of a terminal."""


Hash = Annotated[str, Field(pattern=r"^([0-9a-f]{64})?$")]
"""A sha256; empty if there is nothing to hash."""


LearnedFrom = Literal["state", "triplets", "process", "nothing"]


class Learned(Record):
    """The origin of what a controller had learned before its test.

    Attributes:
        code_sha256: hash of all code of the controller that learned it.
        settings: of that controller.
    """

    code_sha256: Hash
    settings: dict[str, Any]


class Setting(Record):
    """What was tested, and with what: everything that decides the scores.

    Attributes:
        condition, objects, object_names, scene, scene_sha256: of the test.
        control_version: of the way of control; 1 in results made before it was kept.
        controller, controller_sha256: as named by the user, of a file without its folder; hash of
            all its code (in early results, of the file that defines it).
        settings: of the controller, whole; empty where it has none.
        learned: what made the state that it continued from; None if there was none (and in
            early results).
        learned_from: the state that it handed over at play, the recording's triplets, its own play
            in the same process, or nothing, if it was tested as made; None in early results.
        run_sha256, run_steps: hash and length of the recording it learned from; empty, 0 if none.
        goals_sha256: hash of the goal set's content.
        n_goals: how many goals the set has; None if an old result does not say.
        goal_numbers: the goals to test, ascending, from 0.
        trial_steps: length of a trial.
        seed: of the test.
        versions: of Python and the packages that can change the outcome, and the physics.
    """

    condition: Line
    control_version: int = Field(1, ge=1, lt=2**31)
    objects: int
    object_names: tuple[Line, ...]
    scene: Line
    scene_sha256: Hash
    controller: Line
    controller_sha256: Hash
    settings: dict[str, Any] = Field(default_factory=dict)
    learned: Learned | None = None
    learned_from: LearnedFrom | None = None
    run_sha256: Hash
    run_steps: int
    goals_sha256: Hash
    n_goals: int | None
    goal_numbers: tuple[int, ...]
    trial_steps: int
    seed: int
    versions: dict[Line, Line]

    @model_validator(mode="after")
    def _goals_are_of_the_set(self) -> Setting:
        numbers = self.goal_numbers
        if any(before >= after for before, after in pairwise((-1, *numbers))):
            raise ValueError("goal_numbers must ascend, from 0")
        if numbers and self.n_goals is not None and numbers[-1] >= self.n_goals:
            raise ValueError(f"a set of {self.n_goals} goals has no goal {numbers[-1]}")
        return self

    @property
    def set_size(self) -> int:
        """How many goals the set has, as far as known."""
        return len(self.goal_numbers) if self.n_goals is None else self.n_goals


class TrialResult(Record):
    """One trial.

    Attributes:
        goal: its number in the goal set, from 0.
        challenge: its class.
        distances: of each object to its goal, metres.
        final_poses: where the objects ended, position and quaternion each.
        actions_sha256: hash of every command that was executed.
        commands: these commands; None in a result made before they were kept.
    """

    goal: int
    challenge: str
    distances: tuple[float, ...]
    final_poses: tuple[Pose, ...]
    actions_sha256: Hash
    commands: Commands | None = None

    @model_validator(mode="after")
    def _hash_is_that_of_the_commands(self) -> TrialResult:
        if self.commands is not None and self.commands.sha256 != self.actions_sha256:
            raise ValueError("actions_sha256 is not that of the commands")
        return self

    @model_validator(mode="after")
    def _objects_fit(self) -> TrialResult:
        if self.challenge not in CHALLENGES:
            raise ValueError(
                f"unknown challenge {self.challenge!r}: use one of {', '.join(CHALLENGES)}"
            )
        if min(self.distances, default=-1.0) < 0 or len(self.final_poses) != len(self.distances):
            raise ValueError("each object needs its distance, 0 or more, and its final pose")
        return self

    @property
    def score(self) -> float:
        """M_g, in (0, number of objects]."""
        return float(object_scores(self.distances).sum())


class Result(Record):
    """An extrinsic phase, finished or not: what was tested, and what happened.

    Everything derived from these is computed on demand.

    Attributes:
        setting: what was tested.
        trials: in the order of their goals.
        seconds: wall time of each trial, by goal number: nothing else differs when repeated.
    """

    setting: Setting
    trials: tuple[TrialResult, ...] = ()
    seconds: dict[int, float] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _trials_are_of_this_test(self) -> Result:
        numbers = [trial.goal for trial in self.trials]
        if len(set(numbers)) < len(numbers) or numbers != sorted(numbers):
            raise ValueError("trials must be in order, each goal once")
        if other := sorted(set(numbers) - set(self.setting.goal_numbers)):
            raise ValueError(f"there is a trial of goal {other[0]}, which was not asked for")
        if any(len(trial.distances) != self.setting.objects for trial in self.trials):
            raise ValueError(f"trials must have {counted(self.setting.objects, 'object')}")
        return self

    @model_validator(mode="after")
    def _commands_are_of_these_trials(self) -> Result:
        commands = [trial.commands for trial in self.trials if trial.commands is not None]
        if len(commands) not in (0, len(self.trials)):
            raise ValueError("either all trials keep their commands, or none")
        if any(kept.n_steps != self.setting.trial_steps for kept in commands):
            raise ValueError(f"the commands of a trial must last {self.setting.trial_steps} steps")
        return self

    def with_trial(self, trial: TrialResult, seconds: float) -> Result:
        """The result with one more trial."""
        trials = sorted([*self.trials, trial], key=lambda trial: trial.goal)
        times = dict(sorted({**self.seconds, trial.goal: seconds}.items()))
        return self.model_copy(update={"trials": tuple(trials), "seconds": times})

    def __repr__(self) -> str:
        setting = self.setting
        of = f"{setting.controller}, {setting.condition}, {counted(setting.objects, 'object')}"
        score = f"{self.score:.3f}, {self.share}" if self.trials else "no trial yet"
        return f"<Result of {quoted(of)}: {score}>"

    __str__ = __repr__

    @property
    def keeps_commands(self) -> bool:
        """Whether its trials can be replayed."""
        return all(trial.commands is not None for trial in self.trials)

    @property
    def is_finished(self) -> bool:
        """Whether every trial that was asked for has been run."""
        return len(self.trials) == len(self.setting.goal_numbers)

    @property
    def is_complete(self) -> bool:
        """Whether every goal of the set has been tested."""
        return len(self.trials) == self.setting.set_size

    @property
    def share(self) -> str:
        """How much of the goal set has been tested, e.g. ``5 of 50 goals``."""
        done, whole = len(self.trials), self.setting.set_size
        return counted(done, "goal") if self.is_complete else f"{done} of {counted(whole, 'goal')}"

    @property
    def score(self) -> float:
        """M: the mean over the goals tested so far; raises ResultError if there are none."""
        if not self.trials:
            raise ResultError("the result has no trial yet")
        return float(np.mean([trial.score for trial in self.trials]))

    def to_json(self) -> Content:
        """The file's content: setting, trials, the seal, and the times."""
        fields = self.model_dump(mode="json")
        content = {
            "format": FORMAT,
            "version": VERSION,
            "setting": fields["setting"],
            "trials": [_without_none(trial) for trial in fields["trials"]],
            TIMING: {"seconds": fields["seconds"]},
        }
        return sealed(content)

    def save(self, path: Path) -> None:
        """Write the file; it appears whole. Raises ResultError if it would be too large."""
        text = (json.dumps(self.to_json(), indent=1) + "\n").encode()
        check_writable(path, text)
        write_atomically(path, text)


def load_result(path: Path) -> Result:
    """Read a result file.

    Raises:
        ResultError: it does not exist, is not a result, contradicts itself, was altered after it
            was sealed, or was written by a newer version.
    """
    content = read_content(path)
    result = parse_content(content, path)
    if not is_sealed(content):
        raise ResultError(f"{path} was altered: its seal does not match its content")
    return result


def parse_content(content: Content, path: Path) -> Result:
    """The result of a file's content, whether or not its seal holds; raises ResultError."""
    try:
        return _parse(upgrade(content))
    except ValidationError as error:
        raise ResultError(f"{path} is damaged: {faults(error, 3)}") from error
    except ValueError as error:
        raise ResultError(f"{path} is damaged: {quoted(str(error), 200)}") from error


def _without_none(fields: Content) -> Content:
    return {key: value for key, value in fields.items() if value is not None}


def _parse(fields: Content) -> Result:
    about = ("format", "version", TIMING, SEAL)
    facts = {key: fields[key] for key in fields if key not in about}
    timing = fields.get(TIMING)
    seconds = timing.get("seconds") if isinstance(timing, dict) else None
    return Result.model_validate({**facts, "seconds": seconds})
