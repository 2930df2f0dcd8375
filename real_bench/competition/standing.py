"""How far a submission has come in a round, as it is kept in its folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from real_bench.errors import ExperimentError, faults
from real_bench.files import write_whole

FILE = "standing.json"

Status = Literal[
    "waiting", "scored", "crashed", "out of time", "out of memory", "broken rule", "refused"
]
WAITING: Status = "waiting"
SCORED: Status = "scored"
REFUSED: Status = "refused"

STATUS_OF: dict[str, Status] = {
    "ControllerFailedError": "crashed",
    "PhysicsError": "crashed",
    "OutOfTimeError": "out of time",
    "OutOfMemoryError": "out of memory",
    "BrokenRuleError": "broken rule",
    "SubmissionError": REFUSED,
    "ControllerError": REFUSED,
}
"""By the class of the error that ended a job. Any other error is no fault of the submission."""


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Failed(_Record):
    """What ended a job: the status that it gives, in a line, and how long it took."""

    status: Status
    detail: str
    seconds: float = 0.0


class Standing(_Record):
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

    key: str
    name: str
    authors: tuple[str, ...]
    description: str
    sha256: str
    date: str
    status: Status
    detail: str = ""
    failures: dict[str, Failed] = {}
    seconds: float = 0.0

    def with_failure(self, job: str, failed: Failed) -> Standing:
        """The same with one more failure; the first by name is the one that is told."""
        failures = dict(sorted({**self.failures, job: failed}.items()))
        first = next(iter(failures.values()))
        seconds = sum(each.seconds for each in failures.values())
        detail = {"status": first.status, "detail": first.detail, "seconds": seconds}
        changes = {"failures": failures, **detail}
        return self.model_copy(update=changes)

    def save(self, home: Path) -> None:
        """Keep it in its folder; it appears whole."""
        text = json.dumps(self.model_dump(mode="json"), indent=1, ensure_ascii=False)
        write_whole(home / FILE, f"{text}\n".encode())


def load_standing(home: Path) -> Standing | None:
    """What is kept in a folder; None where nothing is. Raises ExperimentError."""
    path = home / FILE
    if not path.exists():
        return None
    try:
        return Standing.model_validate_json(path.read_text(encoding="utf-8"))
    except ValidationError as error:
        raise ExperimentError(f"{path} is damaged: {faults(error, 3)}") from error
    except UnicodeDecodeError as error:
        raise ExperimentError(f"{path} is damaged: {error}") from error
