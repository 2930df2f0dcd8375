"""Read the files that the user named: one, all in a folder, or all that match a pattern."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from real_bench.errors import ResultError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from real_bench.scoring.result import Result


def read_results(named: str) -> list[Result]:
    """The results that a path or a pattern names.

    Of a folder, JSON files that are something else are left out.

    Raises:
        ResultError: there are none, or one cannot be read.
    """
    from real_bench.scoring.result import load_result

    path = Path(named)
    if path.is_dir():
        results = list(_results_in(path))
    elif any(sign in named for sign in "*?[") and not path.exists():
        results = [load_result(file) for file in _matching(path)]
    else:
        results = [load_result(path)]
    if not results:
        raise ResultError(f"no result found in {named}")
    return results


def _results_in(folder: Path) -> Iterator[Result]:
    from real_bench.scoring.result import load_result
    from real_bench.scoring.result_file import ForeignFileError

    for file in sorted(folder.glob("*.json")):
        try:
            yield load_result(file)
        except ForeignFileError:  # e.g. the standing in an entry's folder of a round
            continue


def _matching(pattern: Path) -> list[Path]:
    """The files that match; raises ResultError if it is no pattern."""
    try:
        return sorted(Path(pattern.anchor).glob(str(pattern.relative_to(pattern.anchor))))
    except (ValueError, OSError) as error:
        raise ResultError(f"{pattern} is not a pattern: {error}") from error
