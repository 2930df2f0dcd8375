"""Verify many results, each with what came with it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from real_bench.cli.common import progress_display
from real_bench.cli.printing import print_tables, say

if TYPE_CHECKING:
    from rich.table import Table

    from real_bench.verification import BundleVerdict


def verify_folder(folder: Path, *, as_json: bool, **wanted: Any) -> list[BundleVerdict]:
    """Verify all results in a folder, print a verdict on each, and keep those on a round's.

    Raises:
        ResultError: there is none.
        RealBenchError: the goals or the scene that are given cannot be read.
    """
    from real_bench.competition.verified import keep_verdicts
    from real_bench.errors import ResultError
    from real_bench.goal_sets import load_goal_set
    from real_bench.simulation import load_scene
    from real_bench.verification import BundleVerification, bundles_in

    if wanted.get("goals") is not None:  # if these cannot be read, no bundle is to blame
        load_goal_set(wanted["goals"])
    if wanted.get("scene") is not None:
        load_scene(wanted["scene"])
    verdicts: list[BundleVerdict] = []
    with bundles_in(folder) as bundles:
        if not bundles:
            raise ResultError(f"no result found in {folder}")
        with progress_display("verifying", "results", len(bundles)) as display:
            for _, together in groupby(bundles, lambda bundle: bundle.result.parent):
                mine: list[BundleVerdict] = []
                for bundle in together:
                    display.update(len(verdicts) + len(mine), _name(bundle.result, folder))
                    mine.append(BundleVerification(bundle, **wanted).verify())
                keep_verdicts(mine)  # at once: verifying the rest may take hours
                verdicts += mine
    if as_json:
        say(json.dumps([verdict.to_json() for verdict in verdicts]))
    else:
        _show(verdicts, folder)
    return verdicts


def _show(verdicts: Sequence[BundleVerdict], folder: Path) -> None:
    if len(verdicts) == 1:
        for part in verdicts[0].parts:
            say(f"{part.verdict:11}  {part.what:9}  {part.detail}")
    else:
        print_tables(_table(verdicts, folder))
    for verdict in verdicts:
        say(f"{_name(verdict.bundle.result, folder)}: {_in_a_line(verdict)}")
        if len(verdicts) > 1:
            for part in verdict.parts:
                if part.what in verdict.unchecked:
                    say(f"  {part.verdict}: {part.what}, {part.detail}")


def _table(verdicts: Sequence[BundleVerdict], folder: Path) -> Table:
    from rich import box
    from rich.table import Table

    parts = list(dict.fromkeys(part.what for verdict in verdicts for part in verdict.parts))
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("result", "score", *parts):
        table.add_column(heading)
    for verdict in verdicts:
        found = {part.what: part.verdict for part in verdict.parts}
        score = "-" if verdict.score is None else f"{verdict.score:.4f}"
        name = _name(verdict.bundle.result, folder)
        table.add_row(name, score, *(found.get(part, "-") for part in parts))
    return table


def _in_a_line(verdict: BundleVerdict) -> str:
    if verdict.holds:
        return verdict.detail
    return f"{'undecided' if verdict.is_undecided else 'NOT VERIFIED'}: {verdict.detail}"


def _name(result: Path, folder: Path) -> str:
    return str(result.relative_to(folder))
