"""What belongs together in a folder: a result, the recording it learned from, the submission."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from real_bench.competition.entries import FROZEN
from real_bench.competition.manifest import is_submission
from real_bench.errors import ControllerError, ResultError
from real_bench.files import file_sha256
from real_bench.sandbox.benchmark_files import is_ours
from real_bench.scoring.result import Setting, parse_content
from real_bench.scoring.result_file import read_content
from real_bench.source import ControllerSource, is_left_out


@dataclass(frozen=True)
class Bundle:
    """A result and what came with it.

    Attributes:
        result: the file.
        recording: that it learned from, as far as known; None if there is none.
        submission: the folder of what was tested; None if there is none.
    """

    result: Path
    recording: Path | None
    submission: Path | None


def bundles_in(folder: Path) -> list[Bundle]:
    """All results in a folder and below it, each with what lies beside it."""
    return list(_bundles(folder))


def _bundles(folder: Path) -> Iterator[Bundle]:
    paths = sorted(path for path in folder.iterdir() if not is_left_out(path))
    results = [path for path in paths if path.suffix == ".json" and is_ours(path)]
    recordings = [path for path in paths if path.is_file() and path.suffix in (".h5", ".hdf5")]
    inside = [path for path in paths if path.is_dir()]
    submissions = [path for path in (folder, *inside, _frozen(folder)) if is_submission(path)]
    for result in results:
        yield _bundle(result, recordings, submissions)
    if is_submission(folder):
        return
    for path in inside:
        if not is_submission(path):
            yield from _bundles(path)


def _frozen(folder: Path) -> Path:
    """Where a round keeps the submission whose results lie in a folder."""
    return folder.parent.parent / FROZEN / folder.name


def _bundle(result: Path, recordings: list[Path], submissions: list[Path]) -> Bundle:
    """The result with its recording and submission, found by hash or as the only ones there."""
    try:
        setting = parse_content(read_content(result), result).setting
    except ResultError:
        return Bundle(result, None, None)
    return Bundle(result, _recording(setting, recordings), _submission(setting, submissions))


def _recording(setting: Setting, recordings: list[Path]) -> Path | None:
    found = [path for path in recordings if file_sha256(path) == setting.run_sha256]
    known = found or (recordings if len(recordings) == 1 else [])
    return known[0] if known and setting.run_steps else None


def _submission(setting: Setting, submissions: list[Path]) -> Path | None:
    found = [path for path in submissions if _sha256(path) == setting.controller_sha256]
    known = found or submissions[:1]
    return known[0] if known else None


def _sha256(submission: Path) -> str:
    try:
        return ControllerSource.of(str(submission)).code_sha256
    except ControllerError:
        return ""
