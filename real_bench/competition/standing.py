"""The standing of a submission in a round, as kept in its folder."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal

from pydantic import Field

from real_bench.competition.kept import KeptRecord
from real_bench.inputs.records import Record
from real_bench.text.quoting import quoted

Status = Literal[
    "waiting", "scored", "crashed", "out of time", "out of memory", "broken rule", "refused"
]
WAITING: Status = "waiting"
SCORED: Status = "scored"
BROKEN_RULE: Status = "broken rule"
REFUSED: Status = "refused"

STATUS_OF: dict[str, Status] = {
    "ControllerFailedError": "crashed",
    "ControllerDeclinedError": "crashed",
    "ControllerStoppedError": "crashed",
    "StateError": "crashed",
    "PhysicsError": "crashed",
    "OutOfTimeError": "out of time",
    "OutOfMemoryError": "out of memory",
    "BrokenRuleError": BROKEN_RULE,
    "SubmissionError": REFUSED,
    "ControllerError": REFUSED,
}
"""By the class of the error that ended a job. Any other error is not the submission's fault."""


UNTOLD = "why is not told while the goals are secret"

_PLACE = re.compile(r"(play|test)(, goal \d{1,6}(?=:))?")


class FailureRecord(Record):
    """What ended a job.

    Attributes:
        status: that it gives.
        detail: the reason in a line.
        seconds: that it took.
        task_sha256: of the round as it was; empty in files of old.
    """

    status: Status
    detail: str
    seconds: float = 0.0
    task_sha256: str = ""

    @property
    def place(self) -> str:
        """Where it happened: in play or test, and at which goal; no word of the controller's."""
        found = _PLACE.match(self.detail)
        return found[0] if found else ""

    def without_reason(self) -> FailureRecord:
        """The same, but of the reason only where it happened."""
        return self.model_copy(update={"detail": f"{self.place} ({UNTOLD})".lstrip()})


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

    def with_failures(self, failed: Mapping[str, FailureRecord]) -> Standing:
        """The same with these failures of its jobs; the first by name is shown."""
        failures = dict(sorted(failed.items()))
        first = next(iter(failures.values()))
        seconds = sum(each.seconds for each in failures.values())
        detail = {"status": first.status, "detail": first.detail, "seconds": seconds}
        changes = {"failures": failures, **detail}
        return self.model_copy(update=changes)

    def without_reasons(self) -> Standing:
        """The same, but of its failures only where they happened.

        A controller that has met secret goals could tell them by its error, whose text, class,
        file and line are its own choice; and by settings in which its repeats differ.
        """
        failures = {name: failed.without_reason() for name, failed in self.failures.items()}
        if failures:
            return self.with_failures(failures)
        untold = self.status == BROKEN_RULE
        return self.model_copy(update={"detail": UNTOLD}) if untold else self


def labels(standings: Sequence[Standing]) -> dict[str, str]:
    """What each submission of a round is called, by key: its name, and the key if it is shared."""
    names = {standing.key: quoted(standing.name) for standing in standings}
    times = Counter(names.values())
    return {key: f"{name} ({key})" if times[name] > 1 else name for key, name in names.items()}
