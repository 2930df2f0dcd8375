"""Verify many results, each with what came with it."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from real_bench.cli.common import progress_display
from real_bench.cli.printing import print_tables, say
from real_bench.text.counting import counted
from real_bench.text.quoting import quoted

if TYPE_CHECKING:
    from rich.table import Table

    from real_bench.competition.round_results import RoundResults
    from real_bench.verification import Bundle, BundleVerdict

STATE = "state"
"""Shown although it holds: which goals were drawn."""


def verify_folder(
    folder: Path,
    *,
    as_json: bool,
    limits: Mapping[str, float],
    goals: Path | None = None,
    scene: str | None = None,
    **options: Any,
) -> list[BundleVerdict]:
    """Verify all results in a folder, print a verdict on each, and keep those on a round's.

    Args:
        folder: with results, and below it.
        as_json: whether to print JSON.
        limits: those that are given; the others are a round's, or the defaults.
        goals: of all results; a round of others is passed over. None: of their round, or shipped.
        scene: the same of their scene.
        **options: of each verification.

    Raises:
        ResultError: there is none.
        RealBenchError: the goals or the scene that are given cannot be read.
    """
    from real_bench.competition.round_results import rounds_of
    from real_bench.competition.verified import keep_verdicts
    from real_bench.errors import ResultError
    from real_bench.goal_sets import load_goal_set
    from real_bench.sandbox import Limits
    from real_bench.simulation import load_scene
    from real_bench.verification import BundleVerification, bundles_in

    # if these cannot be read, no bundle is to blame
    hashes = {
        "goals": None if goals is None else load_goal_set(goals).sha256,
        "scene": None if scene is None else load_scene(scene).sha256,
    }
    verdicts: list[BundleVerdict] = []
    with bundles_in(folder) as found:
        rounds = rounds_of((bundle.result.parent for bundle in found), apart_from=folder)
        bundles = _without_passed_over(found, rounds, **hashes)
        if goals is None:
            _say_goals(rounds.values())
        if not bundles:
            raise ResultError(f"no result {'to verify' if found else 'found'} in {folder}")
        with progress_display("verifying", "results", len(bundles)) as display:
            for home, together in groupby(bundles, lambda bundle: bundle.result.parent):
                its_round = rounds.get(home)
                verify = partial(
                    BundleVerification,
                    goals=its_round.goals if its_round and goals is None else goals,
                    scene=scene,
                    limits=replace(its_round.facts.limits if its_round else Limits(), **limits),
                    **options,
                )
                mine: list[BundleVerdict] = []
                for bundle in together:
                    display.update(len(verdicts) + len(mine), _name(bundle.result, folder))
                    mine.append(verify(bundle=bundle).verify())
                if its_round:
                    keep_verdicts(home, mine)  # at once: verifying the rest may take hours
                verdicts += mine
    if as_json:
        say(json.dumps([verdict.to_json() for verdict in verdicts]))
    else:
        _show(verdicts, folder)
    return verdicts


def _say_goals(rounds: Iterable[RoundResults]) -> None:
    """Say which goals are taken, since nobody gave them."""
    taken = {each.facts.name: each.goals for each in rounds if each.goals is not None}
    for name, path in taken.items():
        say(f"round {quoted(name)}: its goals are {path}", err=True)


def _without_passed_over(
    bundles: Sequence[Bundle], rounds: Mapping[Path, RoundResults], **given: str | None
) -> list[Bundle]:
    """The bundles that are to be verified; says how many are not, and why."""
    kept: list[Bundle] = []
    reasons: Counter[str] = Counter()
    for bundle in bundles:
        its_round = rounds.get(bundle.result.parent)
        if its_round and (reason := its_round.why_passed_over(bundle.result, **given)):
            reasons[reason] += 1
        else:
            kept.append(bundle)
    for reason, number in reasons.items():
        say(f"{counted(number, 'result')} passed over: {reason}", err=True)
    return kept


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
                if part.what in (*verdict.unchecked, STATE):
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
