"""Whether a submission's results are good enough, for CI and for people."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from numbers import Real
from typing import TYPE_CHECKING, Any

from real_bench.errors import ControllerError, ControllerFailedError, ResultError
from real_bench.inputs.numeric import short
from real_bench.lengths import TRIAL_STEPS
from real_bench.physics import mixture, physics_of
from real_bench.scoring.comparison import Comparison, compare
from real_bench.scoring.metric import METRICS
from real_bench.scoring.one_test import check_one_test, mixed_sources, sources_of
from real_bench.scoring.parts import describe_play, describe_sum
from real_bench.scoring.repeats import RepeatsSummary, by_goal, summarise_repeats
from real_bench.scoring.result import Result, Setting
from real_bench.scoring.statistics import OVER_GOALS, interval_heading
from real_bench.text.counting import counted
from real_bench.text.naming import display_name
from real_bench.text.quoting import markdown as _escaped
from real_bench.text.quoting import quoted

if TYPE_CHECKING:
    from junitparser import JUnitXml


@dataclass(frozen=True)
class Check:
    """Something that must hold.

    Attributes:
        name: what.
        passed: whether it does.
        detail: the numbers.
    """

    name: str
    passed: bool
    detail: str


@dataclass(frozen=True)
class Verdict:
    """The verdict on a submission.

    Attributes:
        setting: what was tested; of the first result.
        summary: of all results together.
        comparison: with the baseline, if there is one.
        checks: all that must hold.
        seconds: that the trials took.
        physics: of each of the results, the baseline's last.
        sources: the code of realbench that made each of the results.
    """

    setting: Setting
    summary: RepeatsSummary
    comparison: Comparison | None
    checks: tuple[Check, ...]
    seconds: float = 0.0
    physics: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()

    def __repr__(self) -> str:
        outcome = "passed" if self.passed else f"failed ({self.failures})"
        return f"<Verdict on {quoted(display_name(self.setting.controller))}: {outcome}>"

    @property
    def passed(self) -> bool:
        """Whether everything holds."""
        return all(check.passed for check in self.checks)

    @property
    def failures(self) -> str:
        """What does not hold, in a line; empty if everything does."""
        failed = (check for check in self.checks if not check.passed)
        return "; ".join(f"{check.name}: {check.detail}" for check in failed)

    def to_json(self) -> dict[str, Any]:
        """Every number."""
        return {
            "passed": self.passed,
            "checks": [asdict(check) for check in self.checks],
            "setting": self.setting.model_dump(mode="json"),
            "summary": self.summary.to_json(),
            "comparison": self.comparison.to_json() if self.comparison else None,
            "physics": sorted(set(self.physics)),
            "sources": sorted(set(self.sources)),
        }


def check_minimum(minimum: float | None) -> None:
    """Raise ResultError unless it is a number, or None."""
    if minimum is not None and not (isinstance(minimum, Real) and math.isfinite(minimum)):
        raise ResultError(f"the minimum must be a number, not {short(minimum)}")


def judge(
    results: Sequence[Result],
    minimum: float | None = None,
    baseline: Sequence[Result] | None = None,
    *,
    goals: str | None = None,
    sizes: Mapping[str, int] | None = None,
    allow_part: bool = False,
) -> Verdict:
    """Judge the results of one controller.

    Args:
        results: on one or more goal sets; those on the same set are repeats.
        minimum: the lowest mean score that passes.
        baseline: results on the same goals; the others must not be worse beyond chance.
        goals: hash of the goal set that all must be of; None: any.
        sizes: how many goals sets have, by hash; for other sets, results are believed.
        allow_part: whether results may cover only a part of their goals, if that was asked for.

    Raises:
        ResultError: the results are not of one test, or the baseline is on other goals.
    """
    check_minimum(minimum)
    check_one_test(results)
    summary = summarise_repeats(by_goal(results))
    checks = [
        _check_complete(results, sizes or {}, allow_part=allow_part),
        _check_length(results),
        _check_goals(results, goals, sizes or {}),
    ]
    if minimum is not None:
        mean = summary.score.mean
        is_clear = (round(mean, 4) >= minimum) == (mean >= minimum)
        shown = f"{mean:.4f}" if is_clear else str(mean)
        checks.append(Check("minimum", mean >= minimum, f"{shown}, at least {minimum} required"))
    comparison = None if baseline is None else compare(results, baseline)
    if comparison is not None:
        score = comparison.score
        over = score.interval.over if score.interval else OVER_GOALS
        detail = f"{score.difference:+.4f}, {interval_heading(over)}: {score.interval or 'none'}"
        if over == OVER_GOALS:
            detail += ", after these plays"
        checks.append(Check("not worse than the baseline", not comparison.is_worse, detail))
    seconds = sum(sum(result.seconds.values()) for result in results)
    physics = tuple(physics_of(each.setting.versions) for each in (*results, *(baseline or ())))
    return Verdict(
        results[0].setting,
        summary,
        comparison,
        tuple(checks),
        seconds,
        physics,
        sources_of(results),
    )


def _check_complete(
    results: Sequence[Result], sizes: Mapping[str, int], *, allow_part: bool
) -> Check:
    settings = [result.setting for result in results]
    whole = [sizes.get(setting.goals_sha256, setting.set_size) for setting in settings]
    done = [len(result.trials) for result in results]
    detail = f"{sum(done)} of {sum(whole)} {'goals' if len(results) == 1 else 'trials'}"
    if done == whole:
        return Check("complete", True, detail)
    if not all(result.is_finished for result in results):
        wanted = sum(len(setting.goal_numbers) for setting in settings)
        return Check("complete", False, f"{detail}, not finished: {wanted} asked for")
    if not allow_part:
        return Check("complete", False, f"{detail} (--allow-part accepts a part)")
    return Check("complete", True, f"{detail}, a part")


def _check_length(results: Sequence[Result]) -> Check:
    steps = results[0].setting.trial_steps  # all are alike
    detail = f"{steps:,} steps per trial"
    if steps != TRIAL_STEPS:
        detail += f", {TRIAL_STEPS:,} required"
    return Check("length", steps == TRIAL_STEPS, detail)


def _check_goals(results: Sequence[Result], goals: str | None, known: Mapping[str, int]) -> Check:
    """Whether they are on the goals asked for; if none are given, say which were accepted."""
    found = sorted({result.setting.goals_sha256 for result in results})
    if goals is None:
        kinds = [
            f"{sha256[:12]}, {'' if sha256 in known else 'not '}the shipped one" for sha256 in found
        ]
        detail = f"goal set {'; '.join(kinds)} (to require a set, use --goals)"
        return Check("goals", True, detail)
    detail = f"goal set {' and '.join(sha256[:12] for sha256 in found)}"
    passed = found == [goals]
    return Check("goals", passed, detail if passed else f"{detail}, not {goals[:12]}")


def markdown(verdict: Verdict) -> str:
    """A page of Markdown for a job summary."""
    from tabulate import tabulate

    setting, summary = verdict.setting, verdict.summary
    objects = counted(setting.objects, "object")
    checks = [
        (check.name, "passed" if check.passed else "**failed**", check.detail)
        for check in verdict.checks
    ]
    score = summary.score
    over = score.interval.over if score.interval else OVER_GOALS
    classes = list(score.by_class)
    rows = []
    for name, metric in METRICS.items():
        found = summary.metrics[name]
        text = metric.text
        numbers = [text(found.interquartile_mean), *map(text, found.by_class.values())]
        rows.append((metric.title, text(found.mean), metric.interval(found.interval), *numbers))
    parts = [
        f"## {_escaped(display_name(setting.controller))} "
        f"{'passed' if verdict.passed else 'failed'}",
        f"REAL_{setting.condition}, {objects}, scene {_escaped(setting.scene)}, "
        f"{describe_play(setting)}; {counted(summary.n_goals, 'goal')}, each tested "
        f"{_times(summary)}.",
        tabulate(checks, ("check", "", ""), "github", disable_numparse=True),
        tabulate(
            rows,
            ("", "mean", interval_heading(over), "interquartile mean", *classes),
            "github",
            disable_numparse=True,
        ),
        *describe_sum(setting.objects),
        *filter(None, [mixture(verdict.physics), mixed_sources(verdict.sources)]),
    ]
    return "\n\n".join(parts) + "\n"


def _times(summary: RepeatsSummary) -> str:
    times = "once" if summary.n_repeats == 1 else f"{summary.n_repeats} times"
    if summary.n_plays == summary.n_repeats:
        return times
    return f"{times}, after {counted(summary.n_plays, 'play')}"


def junit(verdict: Verdict) -> JUnitXml:
    """The checks as test cases that CI systems show."""
    properties = {"score": f"{verdict.summary.score.mean:.6f}"}
    return _cases(verdict.setting.controller, verdict.checks, properties, verdict.seconds)


def failure(controller: str, error: ControllerError, seconds: float) -> tuple[str, JUnitXml]:
    """Markdown and test cases for a controller whose test did not finish.

    For CI it is an error if it failed, and a failure if it was not fit to run.

    Args:
        controller: as results name it.
        error: why it did not.
        seconds: that it took.
    """
    line = quoted(str(error), longest=2000)
    page = f"## {_escaped(display_name(controller))} not tested to the end\n\n{_escaped(line)}\n"
    failed = isinstance(error, ControllerFailedError)
    return page, _cases(controller, [Check("runs", False, line)], {}, seconds, failed=failed)


def _cases(
    name: str,
    checks: Sequence[Check],
    properties: Mapping[str, str],
    seconds: float,
    *,
    failed: bool = False,
) -> JUnitXml:
    """Checks as test cases; the first carries the total time."""
    from junitparser import Error, Failure, JUnitXml, TestCase, TestSuite

    suite = TestSuite(f"realbench {quoted(name)}")
    for key, value in properties.items():
        suite.add_property(key, value)
    for number, check in enumerate(checks):
        case = TestCase(check.name, classname="realbench.score")
        case.time = round(0.0 if number else seconds, 3)
        case.system_out = check.detail
        if not check.passed:
            case.result = [Error(check.detail) if failed else Failure(check.detail)]
        suite.add_testcase(case)
    report = JUnitXml("realbench")
    report.add_testsuite(suite)
    return report
