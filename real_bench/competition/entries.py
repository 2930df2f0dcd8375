"""The submissions of a round: found, frozen as they were handed in, and made ready to run."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path

from real_bench.competition.standing import REFUSED, WAITING, Standing
from real_bench.controller_code.manifest import FROZEN, MANIFEST, read_submission
from real_bench.controller_code.packing import copy_submission, files_to_submit, open_submission
from real_bench.controller_code.requirements import UnreachableError, packages_of
from real_bench.controller_code.source import ControllerSource, is_ignored
from real_bench.controller_code.submission_faults import as_submission_error
from real_bench.errors import ControllerError, ExperimentError, SubmissionError
from real_bench.files.hashing import file_sha256
from real_bench.files.locks import temporary_folder, write_lock
from real_bench.files.outputs import check_folder
from real_bench.text.quoting import encodable

MAX_KEY_LENGTH = 80

_PLAIN = re.compile(r"[^A-Za-z0-9_.+-]")


@dataclass(frozen=True)
class Entry:
    """A version of a submission.

    Attributes:
        standing: what it says of itself, and why it was refused, if so.
        folder: its files, frozen; None if it was refused, or cannot be run now.
    """

    standing: Standing
    folder: Path | None

    @property
    def version(self) -> str:
        """A name for its folders."""
        return f"{self.standing.key}-{self.standing.sha256[:12]}"


def read_entries(submissions: Path, results: Path, condition: str) -> list[Entry]:
    """All submissions in a folder, each in a folder or an archive, frozen among the results.

    Raises:
        ExperimentError: there are none.
        RealBenchError: they cannot be kept.
    """
    if not submissions.is_dir():
        raise ExperimentError(f"folder not found: {submissions}")
    found = sorted(path for path in submissions.resolve().iterdir() if path.name[0] != ".")
    if not found:
        raise ExperimentError(f"no submission found in {submissions}")
    check_folder(results / FROZEN, make=True)
    if submissions.samefile(results / FROZEN):
        raise ExperimentError(
            f"{submissions} is where results keep their copies of submissions: name other `results`"
        )
    first: dict[str, Path] = {}
    entries = []
    for place in found:
        key = _key(place)
        if first.setdefault(key, place) is place:
            entries.append(_entry(place, key, results / FROZEN, condition))
        else:
            fault = f"{first[key].name} has the same name: rename one"
            entries.append(_refused(place, f"{key},{_short_hash(place.name)}", fault))
    return entries


def _fault(place: Path) -> str:
    """Why something that was handed in is no submission; empty if it may be one."""
    if _is_archive(place):
        return ""
    if not place.is_dir():
        return "it is neither a folder nor a zip"
    if is_ignored(place):
        return "it is a link, a virtual environment or a cache, not a folder of your own"
    return ""


def _is_archive(place: Path) -> bool:
    return place.is_file() and place.suffix.lower() == ".zip"


def _name(place: Path) -> str:
    """What a submission is handed in as, without ``.zip``."""
    return place.stem if _is_archive(place) else place.name


def _key(place: Path) -> str:
    """The same as a plain file name, which no submission of another name has."""
    name = _name(place)
    plain = _PLAIN.sub("_", name)
    if plain == name and len(plain) <= MAX_KEY_LENGTH:
        return plain
    return f"{plain[:MAX_KEY_LENGTH]}-{_short_hash(name)}"


def _short_hash(name: str) -> str:
    return hashlib.sha256(os.fsencode(name)).hexdigest()[:16]


def _entry(place: Path, key: str, frozen: Path, condition: str) -> Entry:
    """A submission as it is taken in; refused, whatever is wrong with it."""
    if fault := _fault(place):
        return _refused(place, key, fault)
    with temporary_folder(".unpacked-", within=frozen) as temporary:
        unpacked = temporary / "submission"
        try:
            with as_submission_error(f"{place.name} cannot be read"):
                entry = _frozen(place, key, unpacked, frozen)
        except ControllerError as error:
            detail = str(error).replace(str(unpacked), place.name).replace(f"{place}/", "")
            return _refused(place, key, detail)
    return _with_packages(entry, condition)


def _frozen(place: Path, key: str, unpacked: Path, frozen: Path) -> Entry:
    """A submission with its files kept as they were handed in; raises ControllerError."""
    folder = open_submission(place, unpacked)
    submission = read_submission(folder)
    source = ControllerSource.of(str(folder))
    files_to_submit(source)  # not too large: hashing it would take long
    sha256 = source.code_sha256
    standing = Standing(
        name=submission.name,
        authors=submission.authors,
        description=submission.description,
        sha256=sha256,
        status=WAITING,
        key=key,
        date=_date(place),
    )
    copy = frozen / f"{key}-{sha256[:12]}"
    _freeze(folder, copy, sha256)
    return Entry(standing, copy)


def _refused(place: Path, key: str, detail: str) -> Entry:
    return Entry(
        Standing(
            name=encodable(_name(place)),
            authors=(),
            description="",
            sha256=_bytes_sha256(place),
            status=REFUSED,
            detail=encodable(detail),
            key=key,
            date=_date(place),
        ),
        None,
    )


def _freeze(folder: Path, to: Path, sha256: str) -> None:
    """Copy a submission; it appears whole. Rounds held at the same time share the copy."""
    with write_lock(to, wait_while=f"copies {to.name}"):
        if _is_copy(to, sha256):
            return
        partial_copy = to.with_name(f".{to.name}")
        for leftover in (partial_copy, to):  # of a process that was killed; or it has changed
            shutil.rmtree(leftover, ignore_errors=True)
        copy_submission(folder, partial_copy)
        if not _is_copy(partial_copy, sha256):
            raise SubmissionError("it changed while it was copied: run the round again")
        partial_copy.replace(to)


def _is_copy(folder: Path, sha256: str) -> bool:
    """Whether a folder holds a whole submission of this hash."""
    with suppress(ControllerError, OSError):
        return ControllerSource.of(str(folder.resolve())).code_sha256 == sha256
    return False


def _with_packages(entry: Entry, condition: str) -> Entry:
    """The entry with its packages installed, or refused, or waiting for the package index."""
    assert entry.folder is not None
    try:
        with as_submission_error("its packages cannot be installed"):
            submission = read_submission(entry.folder)
            if submission.condition != condition:
                made_for = submission.condition
                raise SubmissionError(f"it is made for {made_for}, but the round is {condition}")
            packages_of(submission)
    except (ControllerError, UnreachableError) as error:
        detail = encodable(str(error).replace(f"{entry.folder}/", ""))
        status = REFUSED if isinstance(error, ControllerError) else WAITING
        return Entry(entry.standing.model_copy(update={"status": status, "detail": detail}), None)
    return entry


def _date(place: Path) -> str:
    """When it was handed in: the date of its newest file, but no later than now."""
    now = time.time()
    newest = max((_modified(path) for path in _files(place)), default=0.0)
    moment = datetime.fromtimestamp(min(max(newest, 0.0), now), timezone.utc)
    return moment.isoformat(timespec="seconds")


def _modified(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _bytes_sha256(place: Path) -> str:
    """A hash to tell versions apart of what could not be read: of the file, or of all names."""
    file = place if place.is_file() else place / MANIFEST
    with suppress(OSError):
        if file.is_file():  # a pipe would never end
            return file_sha256(file)
    names = sorted(os.fsencode(each.relative_to(place)) for each in _files(place))
    return hashlib.sha256(b"\0".join(names)).hexdigest()


def _files(place: Path) -> Iterator[Path]:
    """Every file of it that can be seen, however deep."""
    if place.is_file():
        yield place
        return
    folders = [] if place.is_symlink() else [place]
    while folders:
        with suppress(OSError):
            for path in folders.pop().iterdir():
                if path.is_symlink():
                    continue
                if path.is_dir():
                    folders.append(path)
                elif path.is_file():
                    yield path
