"""Records that are kept as JSON in folders of a competition's results."""

from __future__ import annotations

import json
from pathlib import Path
from typing import ClassVar, TypeVar

from pydantic import ValidationError

from real_bench.errors import ExperimentError, faults
from real_bench.files.atomic import write_atomically
from real_bench.inputs.records import Record

Kept = TypeVar("Kept", bound="KeptRecord")


class KeptRecord(Record):
    """A record that has a file of its own in a folder."""

    FILE: ClassVar[str]
    """The file's name."""

    def save(self, folder: Path) -> None:
        """Write it into a folder; it appears whole."""
        text = json.dumps(self.model_dump(mode="json"), indent=1, ensure_ascii=False)
        write_atomically(folder / self.FILE, f"{text}\n".encode())

    @classmethod
    def load(cls: type[Kept], folder: Path) -> Kept | None:
        """Read it from a folder; None if it is not there. Raises ExperimentError."""
        path = folder / cls.FILE
        if not path.exists():
            return None
        try:
            return cls.model_validate_json(path.read_text(encoding="utf-8"))
        except ValidationError as error:
            raise ExperimentError(f"{path} is damaged: {faults(error, 3)}") from error
        except UnicodeDecodeError as error:
            raise ExperimentError(f"{path} is damaged: {error}") from error
