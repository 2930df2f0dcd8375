"""Made-up results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from real_bench.scoring.result import Result, Setting, TrialResult

CLASSES = ("2D", "2D", "2.5D", "3D")


def made(
    distances: Sequence[float], seed: int = 0, classes: Sequence[str] = CLASSES, **changes: Any
) -> Result:
    """A result with one object that ended these far (m) from its goals.

    Args:
        distances: one a trial, of the goals that are asked for.
        seed: of the test.
        classes: of the goals, again and again.
        **changes: of the setting.
    """
    fields = {
        "condition": "OM",
        "objects": 1,
        "object_names": ("cube",),
        "scene": "builtin",
        "scene_sha256": "1" * 64,
        "controller": "real_r",
        "controller_sha256": "2" * 64,
        "run_sha256": "",
        "run_steps": 0,
        "goals_sha256": "3" * 64,
        "n_goals": len(distances),
        "goal_numbers": tuple(range(changes.get("n_goals", len(distances)))),
        "trial_steps": 10_000,
        "seed": seed,
        "versions": {},
    }
    result = Result(setting=Setting(**{**fields, **changes}))
    for goal, distance in zip(result.setting.goal_numbers, distances, strict=False):
        trial = TrialResult(
            goal=goal,
            challenge=classes[goal % len(classes)],
            distances=(distance,),
            final_poses=((0, 0, 0, 0, 0, 0, 1),),
            actions_sha256="4" * 64,
        )
        result = result.with_trial(trial, 1.0)
    return result
