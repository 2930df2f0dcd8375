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
from real_bench.errors import ControllerError, ExperimentError, SubmissionError
from real_bench.files import check_folder, file_sha256
from real_bench.locks import temporary_folder, write_lock
from real_bench.source import ControllerSource, is_ignored
from real_bench.submissions import FROZEN, MANIFEST, read_submission
from real_bench.submissions.blame import as_submission_error
from real_bench.submissions.packing import copy_submission, files_to_submit, open_submission
from real_bench.submissions.requirements import UnreachableError, packages_of

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
        ExperimentError: there are none, or two have the same name.
        RealBenchError: they cannot be kept.
    """
    if not submissions.is_dir():
        raise ExperimentError(f"folder not found: {submissions}")
    found = [path for path in sorted(submissions.iterdir()) if _is_candidate(path)]
    keys = [_key(path) for path in found]
    if twice := sorted({key for key in keys if keys.count(key) > 1}):
        raise ExperimentError(f"two submissions are called {', '.join(twice)}: rename one")
    if not found:
        raise ExperimentError(f"no submission found in {submissions}")
    check_folder(results / FROZEN, make=True)
    if submissions.samefile(results / FROZEN):
        raise ExperimentError(
            f"{submissions} is where results keep their copies of submissions: name other `results`"
        )
    return [_entry(path, results / FROZEN, condition) for path in found]


def _is_candidate(path: Path) -> bool:
    """Whether something is a folder or an archive; nothing else is a submission."""
    return (path.is_dir() and not is_ignored(path)) or (path.is_file() and path.suffix == ".zip")


def _name(place: Path) -> str:
    """What a submission is handed in as, without ``.zip``; always text that can be kept."""
    return _text(place.stem if place.is_file() else place.name)


def _key(place: Path) -> str:
    """The same as a file name, which nothing else in the folder has."""
    name = _name(place)
    plain = _PLAIN.sub("_", name)
    if plain == name.replace(" ", "_") and len(plain) <= MAX_KEY_LENGTH:
        return plain
    own = place.stem if place.is_file() else place.name
    return f"{plain[:MAX_KEY_LENGTH]}-{hashlib.sha256(os.fsencode(own)).hexdigest()[:8]}"


def _text(text: str) -> str:
    """A text in which what is not UTF-8 is a question mark."""
    return text.encode(errors="replace").decode()


def _entry(place: Path, frozen: Path, condition: str) -> Entry:
    """A submission as it is taken in; refused, whatever is wrong with it."""
    with temporary_folder("realbench-entry-") as temporary:
        unpacked = temporary / "submission"
        try:
            with as_submission_error(f"{place.name} cannot be read"):
                entry = _frozen(place, unpacked, frozen)
        except ControllerError as error:
            detail = str(error).replace(str(unpacked), place.name).replace(f"{place}/", "")
            return _refused(place, detail)
    return _with_packages(entry, condition)


def _frozen(place: Path, unpacked: Path, frozen: Path) -> Entry:
    """A submission with its files kept as they were handed in; raises ControllerError."""
    folder = open_submission(place, unpacked)
    submission = read_submission(folder)
    source = ControllerSource.of(str(folder))
    files_to_submit(source)  # not too large: hashing it would take long
    key, sha256 = _key(place), source.code_sha256
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
    _freeze(folder, copy)
    return Entry(standing, copy)


def _refused(place: Path, detail: str) -> Entry:
    return Entry(
        Standing(
            name=_name(place),
            authors=(),
            description="",
            sha256=_bytes_sha256(place),
            status=REFUSED,
            detail=_text(detail),
            key=_key(place),
            date=_date(place),
        ),
        None,
    )


def _freeze(folder: Path, to: Path) -> None:
    """Copy a submission; it appears whole. Rounds held at the same time share the copy."""
    if to.exists():
        return
    with write_lock(to, wait_while=f"copies {to.name}"):
        if to.exists():
            return
        partial_copy = to.with_name(f".{to.name}")
        shutil.rmtree(partial_copy, ignore_errors=True)  # of a process that was killed
        copy_submission(folder, partial_copy)
        partial_copy.replace(to)


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
        detail = _text(str(error).replace(f"{entry.folder}/", ""))
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
    folders = [place]
    while folders:
        with suppress(OSError):
            for path in folders.pop().iterdir():
                if path.is_symlink():
                    continue
                if path.is_dir():
                    folders.append(path)
                elif path.is_file():
                    yield path
