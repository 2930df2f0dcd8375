"""Submissions as archives: packed the same way each time, unpacked without trust."""

from __future__ import annotations

import io
import shutil
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath

from real_bench.counting import counted
from real_bench.errors import SubmissionError
from real_bench.files import write_atomically
from real_bench.source import ControllerSource
from real_bench.submissions import MANIFEST, is_submission

MAX_BYTES = 4 * 2**30
MAX_FILES = 10_000
EPOCH = (1980, 1, 1, 0, 0, 0)
"""The date of every file in an archive, so that the same submission gives the same bytes."""

LINK = 0o120000


def pack(folder: Path, archive: Path) -> list[Path]:
    """Pack a submission; returns the files in it.

    Raises:
        SubmissionError: it is not a submission, or too large.
    """
    source = ControllerSource.of(str(folder))
    if source.submission is None:
        raise SubmissionError(f"{folder} is not a submission: it has no {MANIFEST}")
    files = source.submitted_files()
    _check_size(str(folder), [file.stat().st_size for file in files])
    contents = ((file.relative_to(source.place).as_posix(), file.read_bytes()) for file in files)
    write_atomically(archive, zip_files(contents))
    return files


def zip_files(files: Iterable[tuple[str, bytes]]) -> bytes:
    """An archive of files, by name: the same files give the same bytes."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files:
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content)
    return stream.getvalue()


def unpack(archive: Path, folder: Path) -> None:
    """Unpack a submission into a new folder; it may be packed within a folder of its own.

    Raises:
        SubmissionError: it is not a submission, damaged, too large, or leads elsewhere.
    """
    try:
        with zipfile.ZipFile(archive) as packed:
            entries = [entry for entry in packed.infolist() if not entry.is_dir()]
            _check_size(archive.name, [entry.file_size for entry in entries])
            top = _top(archive, entries)
            folder.mkdir(parents=True)
            for entry, place in _destinations(archive, entries, top):
                target = folder / place
                target.parent.mkdir(parents=True, exist_ok=True)
                with packed.open(entry) as content, target.open("wb") as copy:
                    _copy(content, copy, entry.file_size, archive)
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, ValueError) as error:
        raise SubmissionError(f"{archive.name} cannot be unpacked: {error}") from error
    except FileExistsError as error:
        raise SubmissionError(f"{archive.name} has a file and a folder of the same name") from error


def copy_submission(folder: Path, to: Path) -> None:
    """Copy all files of a submission, and nothing else, into a new folder."""
    source = ControllerSource.of(str(folder))
    files = source.submitted_files()
    _check_size(folder.name, [file.stat().st_size for file in files])
    to.mkdir(parents=True)
    for file in files:
        target = to / file.relative_to(source.place)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, target)


def open_submission(place: Path, folder: Path) -> Path:
    """The folder of a submission: itself, or the new ``folder`` in which its archive is unpacked.

    Raises:
        SubmissionError: it is neither.
    """
    if place.is_dir():
        if not is_submission(place):
            raise SubmissionError(f"{place.name} has no {MANIFEST}")
        return place
    if not place.is_file():
        raise SubmissionError(f"submission not found: {place}")
    unpack(place, folder)
    return folder


def _top(archive: Path, entries: list[zipfile.ZipInfo]) -> PurePosixPath:
    """The folder in an archive that holds the submission."""
    found = [
        path
        for entry in entries
        if (path := PurePosixPath(entry.filename)).name == MANIFEST and len(path.parts) <= 2
    ]
    if not found:
        raise SubmissionError(f"{archive.name} has no {MANIFEST}")
    return min(found, key=lambda path: len(path.parts)).parent


def _destinations(
    archive: Path, entries: list[zipfile.ZipInfo], top: PurePosixPath
) -> Iterator[tuple[zipfile.ZipInfo, str]]:
    """Each file of the submission, and where in its folder it belongs."""
    for entry in entries:
        path = PurePosixPath(entry.filename)
        if path.is_absolute() or ".." in path.parts or "\\" in entry.filename:
            raise SubmissionError(f"{archive.name} has a file that leads out of its folder: {path}")
        if (entry.external_attr >> 16) & 0o170000 == LINK:
            raise SubmissionError(f"{archive.name} has a link, which is not allowed: {path}")
        if path.is_relative_to(top):
            yield entry, str(path.relative_to(top))


def _check_size(name: str, sizes: list[int]) -> None:
    if len(sizes) > MAX_FILES or sum(sizes) > MAX_BYTES:
        raise SubmissionError(
            f"{name} is too large: {counted(len(sizes), 'file')}, {sum(sizes) / 2**20:,.0f} MiB; "
            f"the most are {MAX_FILES:,} files and {MAX_BYTES >> 20:,} MiB"
        )


def _copy(content: object, copy: io.BufferedWriter, size: int, archive: Path) -> None:
    """Copy no more than was declared."""
    left = size
    while piece := content.read(1 << 20):  # type: ignore[attr-defined]
        left -= len(piece)
        if left < 0:
            raise SubmissionError(f"{archive.name} is damaged: a file is larger than declared")
        copy.write(piece)
