"""Check a submission before it is handed in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from real_bench.competition.spec import Play
from real_bench.conditions import Condition
from real_bench.controller_code.manifest import Submission, read_submission
from real_bench.controller_code.packing import files_to_submit
from real_bench.controller_code.requirements import packages_of
from real_bench.controller_code.source import ControllerSource
from real_bench.controller_code.submission_faults import as_submission_error
from real_bench.errors import RealBenchError
from real_bench.phases.checking import ControllerCheck, Finding
from real_bench.sandbox import Limits, SandboxBackend
from real_bench.simulation import load_scene
from real_bench.text.counting import counted


@dataclass(frozen=True)
class SubmissionCheck:
    """A submission to be checked.

    Attributes:
        folder: of the submission.
        objects: how many it plays with.
        limits: what it may use up.
        play: of the round that it is made for, as the round's file says.
    """

    folder: Path
    objects: int = 1
    limits: Limits = field(default_factory=Limits)
    play: Play = "own"

    def findings(self) -> Iterator[Finding]:
        """Run one check after the other, up to the first that fails."""
        try:
            submission = read_submission(self.folder)
            yield Finding("says", True, _describe(submission))
            with as_submission_error("its packages cannot be installed"):
                packages_of(submission)
            wanted = ", ".join(submission.requirements)
            yield Finding("requires", True, wanted or "nothing but realbench")
            yield Finding("hash", True, self._hash())
            yield from self._controller_findings(submission)
        except RealBenchError as error:
            yield Finding("fails", False, str(error))

    @property
    def _spec(self) -> str:
        """What its controller is called; an installed one may have the plain name of its folder."""
        return str(self.folder.resolve())

    def _hash(self) -> str:
        source = ControllerSource.of(self._spec)
        files = files_to_submit(source)
        with as_submission_error(f"{self.folder.name} cannot be read"):
            return f"{source.code_sha256} over {counted(len(files), 'file')}"

    def _controller_findings(self, submission: Submission) -> Iterator[Finding]:
        yield from ControllerCheck(
            self._spec,
            Condition.parse(submission.condition),
            load_scene("builtin"),
            self.objects,
            {},
            SandboxBackend(limits=self.limits),
            is_tested_elsewhere=self.play == "own",
            tests_a_goal=True,
        ).findings()


def _describe(submission: Submission) -> str:
    return f"{submission.name}, by {', '.join(submission.authors)}, for {submission.condition}"
