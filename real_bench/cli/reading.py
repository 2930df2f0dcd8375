"""Read the files that the user named: one, all in a folder, or all that match a pattern."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from real_bench.errors import ResultError

if TYPE_CHECKING:
    from real_bench.scoring.result import Result


def read_results(named: str) -> list[Result]:
    """The results that a path or a pattern names; raises ResultError if there are none."""
    from real_bench.scoring.result import load_result

    path = Path(named)
    if path.is_dir():
        files = sorted(path.glob("*.json"))
    elif any(sign in named for sign in "*?[") and not path.exists():
        files = sorted(Path(path.anchor).glob(str(path.relative_to(path.anchor))))
    else:
        files = [path]
    if not files:
        raise ResultError(f"no result found in {named}")
    return [load_result(file) for file in files]
