"""Whether a submission's results are good enough, for CI and for people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from real_bench.errors import ResultError
from real_bench.finding import shown_name
from real_bench.lengths import TRIAL_STEPS
from real_bench.quoting import markdown as _escaped
from real_bench.quoting import quoted
from real_bench.scoring.comparison import Comparison, by_goal, compare
from real_bench.scoring.repeats import RepeatsSummary, summarise_repeats
from real_bench.scoring.result import Result, Setting
from real_bench.scoring.statistics import Interval, stratified_mean_interval

if TYPE_CHECKING:
    from junitparser import JUnitXml

ONE_TEST = ("controller", "condition", "objects", "scene_sha256", "run_steps", "trial_steps")
"""What must agree between the results of one submission."""


@dataclass(frozen=True)
class Check:
    """Something that must hold.

    Attributes:
        name: what.
        passed: whether it does.
        told: the numbers.
    """

    name: str
    passed: bool
    told: str


@dataclass(frozen=True)
class Verdict:
    """What is to be said of a submission.

    Attributes:
        setting: what was tested; of the first result.
        summary: of all results together.
        interval: 95%, of the mean, resampling goals within their class; None for one goal.
        comparison: with the baseline, where there is one.
        checks: all that must hold.
    """

    setting: Setting
    summary: RepeatsSummary
    interval: Interval | None
    comparison: Comparison | None
    checks: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        """Whether everything holds."""
        return all(check.passed for check in self.checks)

    def to_json(self) -> dict[str, Any]:
        """Every number."""
        return {
            "passed": self.passed,
            "checks": [asdict(check) for check in self.checks],
            "setting": self.setting.model_dump(mode="json"),
            "summary": asdict(self.summary),
            "interval_over_goals": asdict(self.interval) if self.interval else None,
            "comparison": self.comparison.to_json() if self.comparison else None,
        }


def judge(
    results: Sequence[Result],
    minimum: float | None = None,
    baseline: Sequence[Result] | None = None,
    *,
    goals: str | None = None,
    sizes: Mapping[str, int] | None = None,
    n_goals: int | None = None,
) -> Verdict:
    """Judge the results of one controller.

    Args:
        results: on one or more goal sets; those on the same set are repeats.
        minimum: the least mean score.
        baseline: results on the same goals, than which these must not be worse beyond chance.
        goals: hash of the goal set that all must be of; None: any.
        sizes: how many goals sets have, by hash; of others, results are believed.
        n_goals: how many goals of a set are enough; None: all.

    Raises:
        ResultError: the results are not of one test, or the baseline is on other goals.
    """
    for name in ONE_TEST:
        values = sorted({str(getattr(result.setting, name)) for result in results})
        if len(values) > 1:
            raise ResultError(
                f"results of different tests are never averaged: {name.replace('_', ' ')} "
                f"{' and '.join(value[:24] for value in values)}"
            )
    scores = by_goal(results)
    summary = summarise_repeats(scores.scores, scores.classes)
    checks = [_complete(results, sizes or {}, n_goals), _of_full_length(results)]
    if goals is not None:
        checks.append(_of_these_goals(results, goals))
    if minimum is not None:
        told = f"{summary.mean:.4f}, at least {minimum} is asked"
        checks.append(Check("minimum", summary.mean >= minimum, told))
    comparison = None if baseline is None else compare(results, baseline)
    if comparison is not None:
        told = f"{comparison.difference:+.4f}, 95% interval {comparison.interval}"
        checks.append(Check("not worse than the baseline", not comparison.is_worse, told))
    interval = stratified_mean_interval(scores.scores.mean(axis=0), scores.classes)
    return Verdict(results[0].setting, summary, interval, comparison, tuple(checks))


def _complete(results: Sequence[Result], sizes: Mapping[str, int], n_goals: int | None) -> Check:
    settings = [result.setting for result in results]
    whole = [sizes.get(setting.goals_sha256, setting.n_goals) for setting in settings]
    asked = whole if n_goals is None else [min(n_goals, n) for n in whole]
    done = [min(len(result.trials), n) for result, n in zip(results, asked, strict=True)]
    return Check("complete", done == asked, f"{sum(done)} of {sum(asked)} trials")


def _of_full_length(results: Sequence[Result]) -> Check:
    steps = results[0].setting.trial_steps  # all are alike
    told = f"{steps:,} steps a trial"
    return Check("length", steps == TRIAL_STEPS, told)


def _of_these_goals(results: Sequence[Result], goals: str) -> Check:
    found = sorted({result.setting.goals_sha256 for result in results})
    passed = found == [goals]
    told = f"goal set {' and '.join(sha256[:12] for sha256 in found)}"
    return Check("goals", passed, told if passed else f"{told}, not {goals[:12]}")


def markdown(verdict: Verdict) -> str:
    """One page of Markdown, fit for a job summary."""
    from tabulate import tabulate

    setting, summary = verdict.setting, verdict.summary
    objects = "1 object" if setting.objects == 1 else f"{setting.objects} objects"
    checks = [
        (check.name, "passed" if check.passed else "**failed**", check.told)
        for check in verdict.checks
    ]
    rows = [
        ("mean", f"{summary.mean:.3f}"),
        ("95% interval over goals", str(verdict.interval or "-")),
        ("interquartile mean", f"{summary.interquartile_mean:.3f}"),
        *((name, f"{mean:.3f}") for name, mean in summary.by_class.items()),
    ]
    parts = [
        f"## {_escaped(shown_name(setting.controller))} {'passed' if verdict.passed else 'failed'}",
        f"REAL_{setting.condition}, {objects}, scene {_escaped(setting.scene)}, after "
        f"{setting.run_steps:,} steps of play; {summary.n_goals} goals, each tested "
        f"{'once' if summary.n_repeats == 1 else f'{summary.n_repeats} times'}.",
        tabulate(checks, ("check", "", ""), "github", disable_numparse=True),
        tabulate(rows, ("score", ""), "github", disable_numparse=True),
    ]
    return "\n\n".join(parts) + "\n"


def junit(verdict: Verdict) -> JUnitXml:
    """The checks as test cases that CI systems show."""
    properties = {"score": f"{verdict.summary.mean:.6f}"}
    return _cases(verdict.setting.controller, verdict.checks, properties)


def failure(told: str) -> tuple[str, JUnitXml]:
    """Markdown and test cases for a controller that could not be tested to the end."""
    line = quoted(told, longest=2000)
    page = f"## Not tested to the end\n\n{_escaped(line)}\n"
    return page, _cases("controller", [Check("runs", False, line)], {})


def _cases(name: str, checks: Sequence[Check], properties: Mapping[str, str]) -> JUnitXml:
    from junitparser import Failure, JUnitXml, TestCase, TestSuite

    suite = TestSuite(f"realbench {quoted(name)}")
    for key, value in properties.items():
        suite.add_property(key, value)
    for check in checks:
        case = TestCase(check.name, classname="realbench.score")
        case.system_out = check.told
        if not check.passed:
            case.result = [Failure(check.told)]
        suite.add_testcase(case)
    report = JUnitXml("realbench")
    report.add_testsuite(suite)
    return report
