"""The formats that a recording can be exported to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from real_bench.errors import RecordingError
from real_bench.exporting.minari import save_minari
from real_bench.exporting.tables import save_csv, save_parquet
from real_bench.recording import Recording

OnExport = Callable[[int, int], None]


@dataclass(frozen=True)
class Export:
    """What to export.

    Attributes:
        recording: open for reading.
        folder: for the files; each appears whole.
        images: whether to include images, if the format can hold any.
        image_size: width and height to which they are shrunk; None: as recorded.
        name: of the dataset, if the format has one; None: from the file's name.
        overwrite: replace what was exported before.
    """

    recording: Recording
    folder: Path
    images: bool = True
    image_size: tuple[int, int] | None = None
    name: str | None = None
    overwrite: bool = False

    def __post_init__(self) -> None:
        if not len(self.recording):
            raise RecordingError(f"{self.recording.path} has no action yet: nothing to export")


FORMATS: dict[str, Callable[[Any, OnExport], str]] = {
    "csv": save_csv,
    "parquet": save_parquet,
    "minari": save_minari,
}
"""By name: what writes it, and says in a line what it wrote."""
