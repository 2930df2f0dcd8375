"""What came of submissions, as JUnit XML: a failure is a bad submission, an error one that failed.

Both are what CI systems show; a job that is broken writes none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from real_bench.phases.checking import Finding
from real_bench.quoting import quoted

if TYPE_CHECKING:
    from junitparser import JUnitXml


def checked(name: str, findings: Sequence[Finding], seconds: float) -> JUnitXml:
    """What was tried of a submission."""
    from junitparser import Failure, JUnitXml, TestCase, TestSuite

    suite = TestSuite(f"realbench submission {quoted(name)}")
    for finding in findings:
        case = TestCase(finding.what, classname="realbench.submission")
        case.time = round(seconds / len(findings), 3)
        case.system_out = quoted(finding.told, 2000)
        if not finding.good:
            case.result = [Failure(quoted(finding.told, 2000), "refused")]
        suite.add_testcase(case)
    report = JUnitXml("realbench")
    report.add_testsuite(suite)
    return report
