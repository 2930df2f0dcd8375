"""Single numbers of recordings and results, for JSON."""

from __future__ import annotations

import math
from typing import Any

from real_bench.analysis import (
    ACTIONS_PER_PERIOD,
    NEAR_M,
    PairDistances,
    action_lengths,
    effective_actions,
)
from real_bench.figures.action_lengths import share_near
from real_bench.figures.coverage import object_coverage
from real_bench.figures.data import FigureData
from real_bench.figures.effective_actions import passes_1_cm
from real_bench.figures.played import FigureOptions, Play
from real_bench.figures.tested import Tested
from real_bench.provenance import package_versions


def facts(figure_data: FigureData, options: FigureOptions) -> dict[str, Any]:
    """The sources of the figures, and their single numbers."""
    return {
        "recordings": [_played(play) for play in figure_data.plays],
        "results": [_tested(tested) for tested in figure_data.tested],
        "asked": {
            "settings": dict(options.settings),
            "seed": options.seed,
            "run_steps": options.run_steps,
        },
        "versions": package_versions(),
    }


def _played(play: Play) -> dict[str, Any]:
    header = play.header
    return {
        "label": play.label,
        "file": play.file,
        "sha256": play.sha256,
        **header.model_dump(
            mode="json", include={"controller", "condition", "objects", "scene", "seed"}
        ),
        "versions": header.versions,
        "steps": int(play.ended_at[-1]) if len(play.ended_at) else 0,
        "actions": len(play.displacements),
        "actions_planned_with": len(play.places),
        "actions_that_moved_an_object": _moves(play),
        "threshold_of_1_cm": _threshold(play),
        "share_of_cells_visited": {
            one.name: {"table": _rounded(one.on_table), "shelf": _rounded(one.on_shelf)}
            for one in object_coverage(play)
        },
        "sight": _sight(play),
    }


def _moves(play: Play) -> dict[str, Any]:
    lengths = action_lengths(play.displacements)
    latest = action_lengths(play.displacements[-ACTIONS_PER_PERIOD:])
    return {
        "all": len(lengths),
        f"of_the_last_{ACTIONS_PER_PERIOD}": len(latest),
        "share_shorter_than_20_cm": _rounded(share_near(lengths)),
    }


def _threshold(play: Play) -> dict[str, int] | None:
    """At which level of REAL-D a threshold passes 1 cm, and how many actions are effective."""
    abstraction = play.abstraction(play.places)
    level = passes_1_cm(abstraction)
    if level == abstraction.n_levels:
        return None
    count = int(effective_actions(play.places, abstraction)[level])
    return {"level": level, "effective_actions": count}


def _sight(play: Play) -> dict[str, Any] | None:
    if play.sight is None:
        return None
    pairs = play.sight.pairs
    return {
        "weights": "recorded" if play.sight.is_recorded else "learned now",
        "settings": dict(play.sight.settings),
        "latent_against_real": {
            "all": _correlations(pairs),
            "1-20 cm": _correlations(pairs.within(*NEAR_M)),
        },
    }


def _tested(tested: Tested) -> dict[str, Any]:
    setting = tested.result.setting
    return {
        "file": tested.file,
        "sha256": tested.sha256,
        **setting.model_dump(
            mode="json",
            include={"controller", "condition", "run_sha256", "run_steps", "goals_sha256"},
        ),
        "score": tested.result.score,
        "goals": tested.result.share,
    }


def _correlations(pairs: PairDistances) -> dict[str, float | None]:
    return {"spearman": _rounded(pairs.spearman), "pearson": _rounded(pairs.pearson)}


def _rounded(number: float) -> float | None:
    """Rounded to three digits; None for NaN."""
    return None if math.isnan(number) else round(number, 3)
