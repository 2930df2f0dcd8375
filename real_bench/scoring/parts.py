"""Remarks on results that are easily misread: a part, few goals, several objects, no learning."""

from __future__ import annotations

from collections.abc import Sequence

from real_bench.scoring.result import Result, Setting
from real_bench.text.counting import counted

FEW_GOALS = 20
"""Intervals over fewer hold the truth too rarely."""


def describe_part(results: Sequence[Result]) -> list[str]:
    """A line for each share of a goal set that is not the whole."""
    shares = dict.fromkeys(result.share for result in results if not result.is_complete)
    return [f"a part: only {share} of the set were tested" for share in shares]


def warn_of_few(n_goals: int) -> list[str]:
    """A line if an interval is over few goals."""
    few = f"only {counted(n_goals, 'goal')}: an interval over so few says little"
    return [few] if 1 < n_goals < FEW_GOALS else []


def describe_play(setting: Setting) -> str:
    """After which play it was tested, and whether it learned anything from it."""
    if not setting.run_steps:
        return "without play"
    play = f"{setting.run_steps:,} steps of play"
    made = setting.learned_from == "nothing"
    return f"as made, nothing learned from {play}" if made else f"after {play}"


def describe_sum(n_objects: int) -> list[str]:
    """A line if a score is one of several objects, which could be taken for one of 1."""
    told = f"scores of {n_objects} objects are added: they go up to {n_objects}"
    return [told] if n_objects > 1 else []
