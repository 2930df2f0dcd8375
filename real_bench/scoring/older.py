"""Results of versions 1 and 2, which stored derived numbers as well."""

from __future__ import annotations

import math
from typing import Any

from real_bench.scoring.metric import object_scores
from real_bench.scoring.result_file import VERSION, Content

MAX_GOALS = 100_000
MAX_VALUE = 1e9
DERIVED = ("complete", "summary")


def upgrade(content: Content) -> Content:
    """A file's content in today's form; summaries are dropped unread.

    Raises:
        ValueError: it does not fit its version.
    """
    version = content["version"]
    if version == VERSION:
        return content
    facts = {key: value for key, value in content.items() if key not in DERIVED}
    setting, trials = facts.get("setting"), facts.get("trials")
    if not isinstance(setting, dict) or not isinstance(trials, list):
        raise ValueError("setting or trials are missing")
    return {
        **facts,
        "setting": _setting(setting),
        "trials": [_trial(trial, keeps_commands=version > 1) for trial in trials],
    }


def _setting(setting: dict[str, Any]) -> dict[str, Any]:
    """Then, ``n_goals`` was how many goals were asked for: the first of the set."""
    count = setting.get("n_goals")
    if not isinstance(count, int) or not 0 <= count <= MAX_GOALS or "goal_numbers" in setting:
        raise ValueError(f"n_goals must be 0 to {MAX_GOALS:,}")
    return {**setting, "n_goals": None, "goal_numbers": tuple(range(count))}


def _trial(trial: Any, *, keeps_commands: bool) -> dict[str, Any]:
    """Then, the score was stored beside the distances that it follows from."""
    if not isinstance(trial, dict) or ("commands" in trial) != keeps_commands:
        raise ValueError("all trials keep their commands since version 2, and none did before")
    facts = {key: value for key, value in trial.items() if key != "score"}
    if not _is_score(trial.get("score"), trial.get("distances")):
        raise ValueError("the score of a trial does not follow from its distances")
    return facts


def _is_score(score: Any, away: Any) -> bool:
    """Whether a score follows from distances, up to rounding, which machines do differently."""
    if not isinstance(away, list):
        return False
    if not all(isinstance(each, int | float) and 0 <= each <= MAX_VALUE for each in [score, *away]):
        return False
    return math.isclose(score, float(object_scores(away).sum()), rel_tol=1e-9)
