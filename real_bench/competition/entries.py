"""The submissions of a round: found, frozen as they were handed in, and made ready to run."""

from __future__ import annotations

import hashlib
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path

from real_bench.competition.standing import REFUSED, WAITING, Standing
from real_bench.errors import ControllerError, ExperimentError
from real_bench.files import check_folder, file_sha256
from real_bench.locks import temporary_folder
from real_bench.source import ControllerSource, is_ignored
from real_bench.submissions import FROZEN, MANIFEST, Submission, read_submission
from real_bench.submissions.packing import copy_submission, open_submission
from real_bench.submissions.requirements import packages_of

_PLAIN = re.compile(r"[^A-Za-z0-9_.+-]")


@dataclass(frozen=True)
class Entry:
    """A version of a submission.

    Attributes:
        standing: what it says of itself, and why it was refused, if so.
        folder: its files, frozen; None if it was refused.
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
    return [_entry(path, results / FROZEN, condition) for path in found]


def _is_candidate(path: Path) -> bool:
    """Whether something is a folder or an archive; nothing else is a submission."""
    return (path.is_dir() and not is_ignored(path)) or (path.is_file() and path.suffix == ".zip")


def _key(path: Path) -> str:
    return _PLAIN.sub("_", path.stem if path.is_file() else path.name)


def _entry(place: Path, frozen: Path, condition: str) -> Entry:
    key, date = _key(place), _date(place)
    with temporary_folder("realbench-entry-") as temporary:
        try:
            folder = open_submission(place, temporary / "submission")
            submission = read_submission(folder)
            sha256 = ControllerSource.of(str(folder)).code_sha256
        except (ControllerError, OSError) as error:
            detail = str(error).replace(str(temporary / "submission"), place.name)
            refused = Standing(
                name=place.stem,
                authors=(),
                description="",
                sha256=_bytes_sha256(place),
                status=REFUSED,
                detail=detail.replace(f"{place}/", ""),
                key=key,
                date=date,
            )
            return Entry(refused, None)
        standing = Standing(
            name=submission.name,
            authors=submission.authors,
            description=submission.description,
            sha256=sha256,
            status=WAITING,
            key=key,
            date=date,
        )
        entry = Entry(standing, frozen / f"{key}-{sha256[:12]}")
        assert entry.folder is not None
        if not entry.folder.exists():
            _freeze(folder, entry.folder)
    return _install_packages(entry, read_submission(entry.folder), condition)


def _freeze(folder: Path, to: Path) -> None:
    """Copy a submission; it appears whole."""
    partial_copy = to.with_name(f".{to.name}")
    shutil.rmtree(partial_copy, ignore_errors=True)
    copy_submission(folder, partial_copy)
    partial_copy.replace(to)


def _install_packages(entry: Entry, submission: Submission, condition: str) -> Entry:
    """The entry with its packages installed, or refused."""
    detail = ""
    if submission.condition != condition:
        detail = f"it is made for {submission.condition}, but the round is {condition}"
    else:
        try:
            packages_of(submission)
        except ControllerError as error:
            detail = str(error)
    if not detail:
        return entry
    changes = {"status": REFUSED, "detail": detail}
    return Entry(entry.standing.model_copy(update=changes), None)


def _date(place: Path) -> str:
    """When it was handed in: the date of its newest file."""
    newest = max((path.stat().st_mtime for path in _files(place)), default=0.0)
    return datetime.fromtimestamp(newest, timezone.utc).isoformat(timespec="seconds")


def _bytes_sha256(place: Path) -> str:
    """A hash to tell versions apart of what could not be read."""
    file = place if place.is_file() else place / MANIFEST
    return file_sha256(file) if file.is_file() else hashlib.sha256(b"").hexdigest()


def _files(place: Path) -> Iterator[Path]:
    if place.is_file():
        yield place
        return
    for path in place.rglob("*"):
        if path.is_file() and not path.is_symlink():
            yield path
