"""Submissions as archives: packed the same way each time, unpacked without trust."""

from __future__ import annotations

import io
import shutil
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath

from real_bench.controller_code.manifest import MANIFEST, is_submission
from real_bench.controller_code.source import ControllerSource
from real_bench.controller_code.submission_faults import as_submission_error
from real_bench.errors import SubmissionError
from real_bench.files.atomic import write_atomically
from real_bench.text.counting import counted

MAX_BYTES = 768 * 2**20
"""A controller works in a copy of it, in a folder of 1 GiB, where it needs room to write."""

MAX_FILES = 10_000
EPOCH = (1980, 1, 1, 0, 0, 0)
"""The date of every file in an archive, so that the same submission gives the same bytes."""

LINK = 0o120000

COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Of any other, a few bytes could unpack to more than fits in memory, at once."""


def files_to_submit(source: ControllerSource) -> list[Path]:
    """The files of a submission, each to be packed, copied and hashed.

    Raises:
        SubmissionError: they are too large or too many, or cannot be read, or lack the manifest.
    """
    with as_submission_error(f"{source.place.name} cannot be read"):
        files = source.submitted_files()
        if source.place / MANIFEST not in files:
            raise SubmissionError(
                f"{MANIFEST} is taken for a result or goals, which are not handed in: write it in "
                "other words"
            )
        for file in files:  # an archive, a bundle and a page can name only what is UTF-8
            str(file.relative_to(source.place)).encode()
        _check_size(source.place.name, [file.stat().st_size for file in files])
        return files


def pack(folder: Path, archive: Path) -> list[Path]:
    """Pack a submission; returns the files in it.

    Raises:
        SubmissionError: it is not a submission, or too large.
    """
    if not is_submission(folder):
        raise SubmissionError(f"{folder} is not a submission: it has no {MANIFEST}")
    source = ControllerSource.of(str(folder.resolve()))
    files = files_to_submit(source)
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
    with (
        as_submission_error(f"{archive.name} cannot be unpacked"),
        zipfile.ZipFile(archive) as packed,
    ):
        entries = [entry for entry in packed.infolist() if not entry.is_dir()]
        _check_size(archive.name, [entry.file_size for entry in entries])
        top = _top(archive, entries)
        folder.mkdir(parents=True)
        for entry, place in _destinations(archive, entries, top):
            _unpack_file(packed, entry, folder / place, archive)


def _unpack_file(
    packed: zipfile.ZipFile, entry: zipfile.ZipInfo, target: Path, archive: Path
) -> None:
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with packed.open(entry) as content, target.open("xb") as copy:
            _copy(content, copy, entry.file_size, archive)
    except (FileExistsError, NotADirectoryError, IsADirectoryError) as error:
        raise SubmissionError(
            f"{archive.name} has two files, or a file and a folder, of the same name: {target.name}"
        ) from error


def copy_submission(folder: Path, to: Path) -> None:
    """Copy all files of a submission, and nothing else, into a new folder."""
    source = ControllerSource.of(str(folder.resolve()))
    files = files_to_submit(source)
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
        with as_submission_error(f"{place.name} cannot be read"):
            if not is_submission(place):
                raise SubmissionError(f"{place.resolve().name} has no {MANIFEST}")
            return place.resolve()  # an installed controller may have its plain name
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
        if entry.compress_type not in COMPRESSIONS:
            raise SubmissionError(
                f"{archive.name} is not compressed as it should be (deflate): pack it with "
                "`realbench submission pack`"
            )
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
