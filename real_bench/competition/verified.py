"""What came of verifying a submission's results, kept beside them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from real_bench.errors import ExperimentError, faults
from real_bench.files import write_whole

FILE = "verified.json"


class Verified(BaseModel):
    """A verdict on results.

    Attributes:
        results: hashes of their files; of other files it says nothing.
        holds: whether they are proved.
        detail: the verdict in a line.
        date: when.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    results: tuple[str, ...]
    holds: bool
    detail: str
    date: str

    def save(self, home: Path) -> None:
        """Keep it; it appears whole."""
        text = json.dumps(self.model_dump(mode="json"), indent=1, ensure_ascii=False)
        write_whole(home / FILE, f"{text}\n".encode())


def load_verified(home: Path, results: Sequence[str]) -> Verified | None:
    """What is known of results of these hashes; None where nothing is."""
    path = home / FILE
    if not path.exists():
        return None
    try:
        verified = Verified.model_validate_json(path.read_text(encoding="utf-8"))
    except (ValidationError, UnicodeDecodeError) as error:
        detail = faults(error, 3) if isinstance(error, ValidationError) else error
        raise ExperimentError(f"{path} is damaged: {detail}") from error
    return verified if set(results) <= set(verified.results) else None
