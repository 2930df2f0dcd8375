"""What the benchmark's files begin with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

FIRST_BYTES = 4096
RUN_FORMAT = "realbench-run"
"""What a recording says that it is, in an attribute; it may lie anywhere in the file."""


@dataclass(frozen=True)
class FileKind:
    """A kind of file, told by its first bytes.

    Attributes:
        name: as messages call it.
        suffix: that such files have, if nobody names them otherwise.
        magic: what each begins with.
        holds: what its first bytes also hold.
    """

    name: str
    suffix: str
    magic: bytes
    holds: bytes = b""

    def begins(self, first: bytes) -> bool:
        """Whether a file whose first bytes are ``first`` is, or may be, of this kind."""
        return first.lower().startswith(self.magic.lower()) and self.holds in first


RECORDING = FileKind("recording", ".h5", b"\x89HDF")
GOAL_SET = FileKind("goal set", ".npy", b"\x93NUMPY")
RESULT = FileKind("result", ".json", b"{", b"realbench-result")
REPORT = FileKind("report", ".html", b"<!doctype html>")
ARCHIVE = FileKind("archive", ".zip", b"PK")
JUNIT = FileKind("JUnit XML", ".xml", b"<", b"<testsuite")
WHOLE = (RECORDING, GOAL_SET, RESULT, REPORT, ARCHIVE, JUNIT)
"""Kinds of files to which nothing can be appended."""


def first_bytes(path: Path) -> bytes:
    """The bytes by which the kind of a file is told."""
    with path.open("rb") as file:
        return file.read(FIRST_BYTES)
