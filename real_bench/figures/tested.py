"""Results grouped for figures: repetitions of one test together, different tests apart."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from real_bench.analysis import scores_by_goal
from real_bench.errors import ResultError
from real_bench.files.hashing import file_sha256
from real_bench.scoring.result import Result, Setting, load_result
from real_bench.settings import dotted
from real_bench.text.counting import counted
from real_bench.text.naming import display_name, shareable_name


@dataclass(frozen=True)
class Tested:
    """One result.

    Attributes:
        file, sha256: its file's name, and hash.
        result: the result.
    """

    file: str
    sha256: str
    result: Result


@dataclass(frozen=True)
class Series:
    """Results of one test repeated: only the recordings and seeds may differ.

    Attributes:
        controller: its name in figures.
        condition: two letters, as in the paper.
        run_steps: the length of play before the test.
        results: at least one.
    """

    controller: str
    condition: str
    run_steps: int
    results: tuple[Result, ...]

    @property
    def classes(self) -> tuple[str, ...]:
        """The class of each goal."""
        return scores_by_goal(self.results)[0]

    @property
    def by_goal(self) -> NDArray[np.float64]:
        """The mean score of each goal, (n_goals,)."""
        return scores_by_goal(self.results)[1]


def read_tested(path: Path) -> Tested:
    """Read a result; raises ResultError."""
    result = load_result(path)
    return Tested(path.name, file_sha256(path), result)


def check_given_once(tested: Sequence[Tested]) -> None:
    """Raise ResultError, naming two files, where these are of one and the same test."""
    known: dict[_Test, dict[tuple[int, str, str], str]] = {}
    for one in tested:
        setting = one.result.setting
        test = (setting.seed, setting.run_sha256, setting.goals_sha256)
        files = known.setdefault(_Test.of(setting, {}), {})
        if test in files:
            raise ResultError(
                f"{files[test]} and {one.file} are of the same test: give one of them"
            )
        files[test] = one.file


def check_same_goals(tested: Sequence[Tested]) -> None:
    """Raise ResultError, naming two files, where results are not of the same trials."""
    for one in tested[1:]:
        mine, first = _trials(one.result), _trials(tested[0].result)
        if mine != first:
            raise ResultError(
                "results of different goals cannot be drawn together: "
                f"{tested[0].file} is of {_describe_trials(first)}, "
                f"{one.file} of {_describe_trials(mine)}"
            )


def series(tested: Sequence[Tested], explorers: Mapping[str, str]) -> list[Series]:
    """Results by controller and settings, condition, and length of play; in the order given.

    Other code of the same name is another controller; so is one that learned from what a curious
    controller played, where that is known.

    Args:
        tested: the results.
        explorers: who played the recordings at hand that were not played at random, by hash.
    """
    groups: dict[_Test, list[Result]] = {}
    for one in tested:
        groups.setdefault(_Test.of(one.result.setting, explorers), []).append(one.result)
    return [
        Series(_label(test, list(groups)), test.condition, test.run_steps, tuple(results))
        for test, results in groups.items()
    ]


@dataclass(frozen=True)
class _Test:
    """What repetitions of a test have in common; settings and what was learned are JSON."""

    name: str
    settings: str
    code: str
    condition: str
    run_steps: int
    control_version: int
    learned: str
    at_once: bool

    @classmethod
    def of(cls, setting: Setting, explorers: Mapping[str, str]) -> _Test:
        player = explorers.get(setting.run_sha256, "")
        tested = shareable_name(setting.controller)
        curious = shareable_name(player) not in ("", tested)
        return cls(
            display_name(setting.controller)
            + (f", play of {display_name(player)}" if curious else ""),
            json.dumps(setting.settings, sort_keys=True),
            setting.controller_sha256,
            setting.condition,
            setting.run_steps,
            setting.control_version,
            json.dumps(setting.learned and setting.learned.model_dump(), sort_keys=True),
            setting.learned_from == "process",
        )

    @property
    def setting_lines(self) -> list[str]:
        """Each setting, by its dotted name."""
        return [f"{name}={value}" for name, value in dotted(json.loads(self.settings))]

    @property
    def origin_lines(self) -> list[str]:
        """The version of the way of control, and what made that from which the test went on."""
        version = f"control version {self.control_version}"
        learned = json.loads(self.learned)
        if learned is None:
            return [version, "tested in the process in which it played"][: 1 + self.at_once]
        code = f"learned by code {learned['code_sha256'][:6]}"
        settings = dotted(learned["settings"])
        return [version, code, *(f"learned with {name}={value}" for name, value in settings)]


def _label(test: _Test, tests: Sequence[_Test]) -> str:
    """What a test's controller is called: with settings and code where others' differ."""
    namesakes = [other for other in tests if other.name == test.name]
    others = [other.setting_lines for other in namesakes]
    distinguishing = [
        line for line in test.setting_lines if not all(line in other for other in others)
    ]
    same = [
        other
        for other in namesakes
        if (other.settings, other.condition) == (test.settings, test.condition)
    ]
    code = f"code {test.code[:6]}" if len({other.code for other in same}) > 1 else ""
    alike = [other for other in same if other.run_steps == test.run_steps]
    origin = [
        line for line in test.origin_lines if not all(line in other.origin_lines for other in alike)
    ]
    return ", ".join(filter(None, (test.name, *distinguishing, code, *origin)))


def _trials(result: Result) -> tuple[str, int, tuple[int, ...]]:
    setting = result.setting
    goals = tuple(trial.goal for trial in result.trials)
    return setting.goals_sha256, setting.trial_steps, goals


def _describe_trials(trials: tuple[str, int, tuple[int, ...]]) -> str:
    goals_sha256, steps, goals = trials
    return f"{counted(len(goals), 'goal')} of set {goals_sha256[:8]}, {steps:,} steps each"
