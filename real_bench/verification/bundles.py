"""What belongs together in a folder: a result, the recording it learned from, the submission."""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from real_bench.controller_code.benchmark_files import is_benchmark_file
from real_bench.controller_code.manifest import FROZEN, is_submission
from real_bench.controller_code.packing import open_submission
from real_bench.controller_code.source import ControllerSource, is_ignored
from real_bench.errors import ControllerError, ResultError, SubmissionError
from real_bench.files.hashing import file_sha256
from real_bench.files.locks import temporary_folder
from real_bench.scoring.result import Setting, parse_content
from real_bench.scoring.result_file import read_content

PACKED = frozenset({".gz", ".tgz", ".tar", ".bz2", ".xz", ".7z", ".rar"})

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Bundle:
    """A result and what came with it.

    Attributes:
        result: the file.
        recording: that it learned from, or else the one that should be it; None if there is none.
        submission: the folder of what was tested; None if there is none.
    """

    result: Path
    recording: Path | None
    submission: Path | None


@contextmanager
def bundles_in(folder: Path) -> Iterator[list[Bundle]]:
    """All results in a folder and below it, each with what lies beside it.

    Packed submissions are unpacked as long as this lasts; an archive of anything else is passed
    over with a warning.
    """
    with temporary_folder("realbench-bundles-") as unpacked:
        yield list(_bundles(folder, unpacked))


def _bundles(folder: Path, unpacked: Path) -> Iterator[Bundle]:
    paths = sorted(path for path in folder.iterdir() if not is_ignored(path))
    results = [path for path in paths if path.suffix == ".json" and is_benchmark_file(path)]
    recordings = [path for path in paths if path.is_file() and path.suffix in (".h5", ".hdf5")]
    inside = [path for path in paths if path.is_dir()]
    submissions = [path for path in (folder, *inside, _frozen(folder)) if is_submission(path)]
    if results:
        archives = [path for path in paths if path.is_file() and path.suffix == ".zip"]
        submissions += filter(None, (_unpack_submission(path, unpacked) for path in archives))
    for result in results:
        yield _bundle(result, recordings, submissions)
    _warn_of_the_rest(paths, recordings, is_alone=not results)
    if is_submission(folder):
        return
    for path in inside:
        if not is_submission(path):
            yield from _bundles(path, unpacked)


def _warn_of_the_rest(paths: list[Path], recordings: list[Path], *, is_alone: bool) -> None:
    """Say what may have been meant to be verified, and is not."""
    packed = PACKED | {".zip"} if is_alone else PACKED
    for path in paths:
        if path.is_file() and path.suffix in packed:
            log.warning("%s is not looked at: unpack it", path)
        elif is_alone and path in recordings:
            log.warning("%s is not looked at: no result lies beside it", path)


def _unpack_submission(archive: Path, folder: Path) -> Path | None:
    """The submission in an archive, in a new folder; None where it holds none."""
    place = Path(tempfile.mkdtemp(dir=folder)) / archive.stem
    try:
        return open_submission(archive, place)
    except SubmissionError as error:
        log.warning("%s", error)
        return None


def _frozen(folder: Path) -> Path:
    """Where a round keeps the submission whose results lie in a folder."""
    home = folder.resolve()
    return home.parent.parent / FROZEN / home.name


def _bundle(result: Path, recordings: list[Path], submissions: list[Path]) -> Bundle:
    """The result with its recording and submission, found by hash, else by name or as the first."""
    try:
        setting = parse_content(read_content(result), result).setting
    except ResultError:
        return Bundle(result, None, None)
    recording = _recording(setting, result.stem, recordings) if setting.run_steps else None
    return Bundle(result, recording, _submission(setting, submissions))


def _recording(setting: Setting, name: str, recordings: list[Path]) -> Path | None:
    """The one that it learned from; where it is not there, one that will not hold."""
    by_hash = (path for path in recordings if file_sha256(path) == setting.run_sha256)
    by_name = (path for path in recordings if path.stem == name)
    return next(by_hash, None) or next(by_name, None) or next(iter(recordings), None)


def _submission(setting: Setting, submissions: list[Path]) -> Path | None:
    found = [path for path in submissions if _sha256(path) == setting.controller_sha256]
    known = found or submissions[:1]
    return known[0] if known else None


def _sha256(submission: Path) -> str:
    try:
        return ControllerSource.of(str(submission)).code_sha256
    except (ControllerError, OSError, UnicodeError):
        return ""
