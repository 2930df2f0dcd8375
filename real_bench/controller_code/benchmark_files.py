"""Which files in a controller's folder are the benchmark's, and hidden from it."""

from __future__ import annotations

import mmap
import zipfile
from contextlib import suppress
from pathlib import Path

from real_bench.files.kinds import ARCHIVE, FIRST_BYTES, GOAL_SET, RECORDING, RESULT, RUN_FORMAT
from real_bench.goal_sets.official import PICKLED_FROM


def is_benchmark_file(path: Path) -> bool:
    """Whether a file is a recording, a result or a goal set, ours or official, by its content.

    Only bytes are looked at, no library opens the file; so a malicious file can do no harm.
    """
    if not path.is_file():  # a pipe would wait for its writer
        return False
    try:
        with path.open("rb") as file:
            first = file.read(FIRST_BYTES)
            if RECORDING.begins(first):
                with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as whole:
                    return whole.find(RUN_FORMAT.encode()) >= 0
        if ARCHIVE.begins(first):
            return PICKLED_FROM.encode() in _first_of_archive(path)
    except OSError:  # nobody can read it, so the controller cannot either
        return False
    if GOAL_SET.begins(first):
        return b"scene_sha256" in first
    return RESULT.begins(first.lstrip())


def _first_of_archive(path: Path) -> bytes:
    """How the first member of a zip file begins; empty where it cannot be read within bounds."""
    with suppress(Exception), zipfile.ZipFile(path) as archive:  # damage can raise any error
        first = archive.infolist()[0]
        if first.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            with archive.open(first) as member:
                return member.read(FIRST_BYTES)
    return b""
