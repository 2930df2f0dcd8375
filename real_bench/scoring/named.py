"""Read the files that the user named: one, all in a folder, or all that match a pattern."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from real_bench.errors import ResultError

if TYPE_CHECKING:
    from real_bench.scoring.result import Result


def read_results(named: str) -> list[Result]:
    """The results that a path or a pattern names.

    Of a folder, JSON files that are something else are left out.

    Raises:
        ResultError: there are none, or one cannot be read.
    """
    from real_bench.scoring.result import load_result
    from real_bench.scoring.result_file import ForeignFileError

    results = []
    for file in named_files(named):
        try:
            results.append(load_result(file))
        except ForeignFileError:  # e.g. the standing in an entry's folder of a round
            if not Path(named).is_dir():
                raise
    if not results:
        raise ResultError(f"no result found in {named}")
    return results


def named_files(named: str) -> list[Path]:
    """The JSON files of a folder, the files that match a pattern, or the one file of that name.

    Raises:
        ResultError: it is no pattern.
    """
    path = Path(named)
    if path.is_dir():
        return sorted(path.glob("*.json"))
    if any(sign in named for sign in "*?[") and not path.exists():
        return _matching(path)
    return [path]


def _matching(pattern: Path) -> list[Path]:
    """The files that match; raises ResultError if it is no pattern."""
    try:
        return sorted(Path(pattern.anchor).glob(str(pattern.relative_to(pattern.anchor))))
    except (ValueError, OSError) as error:
        raise ResultError(f"{pattern} is not a pattern: {error}") from error
