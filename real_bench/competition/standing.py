"""The standing of a submission in a round, as kept in its folder."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field

from real_bench.competition.kept import KeptRecord

Status = Literal[
    "waiting", "scored", "crashed", "out of time", "out of memory", "broken rule", "refused"
]
WAITING: Status = "waiting"
SCORED: Status = "scored"
REFUSED: Status = "refused"

STATUS_OF: dict[str, Status] = {
    "ControllerFailedError": "crashed",
    "ControllerDeclinedError": "crashed",
    "ControllerStoppedError": "crashed",
    "StateError": "crashed",
    "PhysicsError": "crashed",
    "OutOfTimeError": "out of time",
    "OutOfMemoryError": "out of memory",
    "BrokenRuleError": "broken rule",
    "SubmissionError": REFUSED,
    "ControllerError": REFUSED,
}
"""By the class of the error that ended a job. Any other error is not the submission's fault."""


class FailureRecord(BaseModel):
    """What ended a job: the status it gives, the reason in a line, and the time it took."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    status: Status
    detail: str
    seconds: float = 0.0


class Standing(KeptRecord):
    """A version of a submission in a round.

    Attributes:
        key: the name of its folder or archive, by which it is known from version to version.
        name, authors, description: as it says.
        sha256: the hash over all of it.
        date: when it was handed in.
        status: of the whole.
        detail: why it is not scored, in a line.
        failures: of its jobs, by name.
        seconds: that its tests took, and what failed.
    """

    FILE: ClassVar[str] = "standing.json"

    key: str
    name: str
    authors: tuple[str, ...]
    description: str
    sha256: str
    date: str
    status: Status
    detail: str = ""
    failures: dict[str, FailureRecord] = Field(default_factory=dict)
    seconds: float = 0.0

    def with_failure(self, job: str, failed: FailureRecord) -> Standing:
        """The same with one more failure; the first by name is shown."""
        failures = dict(sorted({**self.failures, job: failed}.items()))
        first = next(iter(failures.values()))
        seconds = sum(each.seconds for each in failures.values())
        detail = {"status": first.status, "detail": first.detail, "seconds": seconds}
        changes = {"failures": failures, **detail}
        return self.model_copy(update=changes)
