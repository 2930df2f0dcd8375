"""Outcomes of submissions as JUnit XML: a failure is a bad submission, an error one that failed.

CI systems show both; a broken job writes none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from real_bench.competition.standing import REFUSED, SCORED, WAITING, Standing, labels
from real_bench.phases.checking import Finding
from real_bench.text.quoting import quoted

if TYPE_CHECKING:
    from junitparser import JUnitXml


def checks_report(name: str, findings: Sequence[Finding], seconds: float) -> JUnitXml:
    """The checks of a submission."""
    from junitparser import Failure, JUnitXml, TestCase, TestSuite

    suite = TestSuite(f"realbench submission {quoted(name)}")
    for finding in findings:
        case = TestCase(finding.what, classname="realbench.submission")
        case.time = round(seconds / len(findings), 3)
        case.system_out = quoted(finding.detail, 2000)
        if not finding.good:
            case.result = [Failure(quoted(finding.detail, 2000), "refused")]
        suite.add_testcase(case)
    report = JUnitXml("realbench")
    report.add_testsuite(suite)
    return report


def standings_report(rounds: Mapping[str, Sequence[Standing]], seconds: float) -> JUnitXml:
    """The outcome of every submission, one suite per round."""
    from junitparser import Error, Failure, JUnitXml, Skipped, TestCase, TestSuite

    report = JUnitXml("realbench")
    for name, standings in rounds.items():
        suite = TestSuite(f"realbench round {quoted(name)}")
        called = labels(standings)
        for standing in standings:
            case = TestCase(called[standing.key], classname=f"realbench.{quoted(name)}")
            case.time = round(standing.seconds, 3)
            detail = quoted(standing.detail, 2000)
            if standing.status == REFUSED:
                case.result = [Failure(detail, standing.status)]
            elif standing.status == WAITING:
                case.result = [Skipped("not done yet")]
            elif standing.status != SCORED:
                case.result = [Error(detail, standing.status)]
            suite.add_testcase(case)
        report.add_testsuite(suite)
    report.time = round(seconds, 3)
    return report
