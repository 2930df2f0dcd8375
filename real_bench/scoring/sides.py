"""What the two sides of a comparison are, and what is to be kept in mind about them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from real_bench.physics import mixture, physics_of
from real_bench.scoring.comparison import Comparison
from real_bench.scoring.one_test import mixed_sources, sources_of
from real_bench.scoring.parts import describe_part, describe_sum, warn_of_few
from real_bench.scoring.repeats import ENOUGH_PLAYS
from real_bench.scoring.result import Result, Setting
from real_bench.scoring.statistics import MIN_PLAYS
from real_bench.settings import dotted
from real_bench.text.quoting import quoted

NAMES = "A", "B"
MAX_LENGTH = 300


def distinguishing(setting: Setting, other: Setting) -> str:
    """How a controller differs from another of the same name: in settings, else in code."""
    if setting.controller != other.controller:
        return ""
    theirs = dict(dotted(other.settings))
    changed = [
        f"{name}={value}"
        for name, value in dotted(setting.settings)
        if name not in theirs or theirs[name] != value
    ]
    if not changed and setting.controller_sha256 != other.controller_sha256:
        changed = [f"code {setting.controller_sha256[:6]}"]
    return quoted(", ".join(changed), MAX_LENGTH)


def side_json(results: Sequence[Result]) -> dict[str, Any]:
    """What one side is: results of one test, whose seeds, goals and recordings may differ."""
    first = results[0].setting
    shared = ("controller", "controller_sha256", "settings", "condition", "objects", "scene")
    lengths = ("run_steps", "trial_steps")
    return {
        **{name: getattr(first, name) for name in (*shared, *lengths)},
        "results": [
            {
                "seed": result.setting.seed,
                "goals_sha256": result.setting.goals_sha256,
                "run_sha256": result.setting.run_sha256,
                "n_goals": len(result.trials),
                "source": source,
            }
            for result, source in zip(results, sources_of(results), strict=True)
        ],
    }


def remarks(comparison: Comparison, a: Sequence[Result], b: Sequence[Result]) -> list[str]:
    """What is to be kept in mind, a line each."""
    both = [*a, *b]
    sources = [sources_of(results) for results in (a, b)]
    mixed = [
        f"{name}: {remark}"
        for name, each in zip(NAMES, sources, strict=True)
        if (remark := mixed_sources(each))
    ]
    if not mixed and set(sources[0]) != set(sources[1]):
        mixed = [
            f"A and B were made by different code of realbench ({quoted(sources[0][0])} and "
            f"{quoted(sources[1][0])}): its own controllers may have changed in between"
        ]
    physics = mixture([physics_of(result.setting.versions) for result in both])
    return [
        *describe_part(both),
        *describe_sum(both[0].setting.objects),
        *warn_of_few(len(comparison.goals)),
        *_describe_plays(comparison),
        *mixed,
        *filter(None, [physics]),
    ]


def _describe_plays(comparison: Comparison) -> list[str]:
    fewest = min(comparison.n_plays)
    if fewest < MIN_PLAYS:
        return [
            "the interval of A - B is for other goals, after these plays: other plays of the same "
            f"two may differ otherwise ({MIN_PLAYS} plays of each show how much)"
        ]
    how = "after the same plays, compared play by play" if comparison.same_plays else "not paired"
    few = f"; fewer than {ENOUGH_PLAYS} plays: too few to compare" * (fewest < ENOUGH_PLAYS)
    return [f"A and B are {how}{few}"]
