"""All figures, in the paper's order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from real_bench.errors import RealBenchError
from real_bench.figures import (
    action_lengths,
    coverage,
    discoveries,
    displacements,
    effective_actions,
    latent_distances,
    logged,
    score_by_goal,
    score_by_length,
)
from real_bench.figures.data import FigureData
from real_bench.figures.drawing import Drawing


@dataclass(frozen=True)
class FigureKind:
    """One figure of the paper.

    Attributes:
        name: also that of its files.
        shows: what it shows, as a caption.
        needs: the data that it needs.
        draw: draws it, or returns None if data is missing.
    """

    name: str
    shows: str
    needs: str
    draw: Callable[[FigureData], Drawing | None]


IMAGES = "a recording with images (realbench intrinsic --images) and two actions to plan with"
RESULTS = "results of complete tests (realbench extrinsic)"

FIGURES = (
    FigureKind(
        "effective-actions",
        "REAL-D: how many actions are effective at each level of abstraction, and how far apart "
        "two states must be there to count as different",
        "a recording with a whole action",
        effective_actions.of_positions,
    ),
    FigureKind(
        "effective-actions-latent",
        "REAL-LD: how many actions are effective at each level of abstraction",
        IMAGES,
        effective_actions.of_codes,
    ),
    FigureKind(
        "latent-distances",
        "Distance of pairs of states in latent and in real space",
        IMAGES,
        latent_distances.of_all,
    ),
    FigureKind(
        "latent-distances-near",
        "Distance of pairs of states in latent and in real space, from 1 to 20 cm",
        f"{IMAGES}, in which objects were 1 to 20 cm apart",
        latent_distances.of_near,
    ),
    FigureKind(
        "action-lengths",
        "How far actions move objects",
        "a recording in which an action moved an object by more than 1 cm",
        action_lengths.draw,
    ),
    FigureKind("score-by-goal", "Score of each goal", RESULTS, score_by_goal.draw),
    FigureKind(
        "displacements",
        "Actions that moved an object by more than 1 cm, along the intrinsic phase "
        "(hollow: of fewer than 500 actions)",
        "a recording with an action",
        displacements.draw,
    ),
    FigureKind(
        "discoveries",
        "What play discovers, and when: actions that moved an object, moved it far, left it higher "
        "(hollow: of fewer than 500 actions)",
        "a recording with an action",
        discoveries.draw,
    ),
    FigureKind(
        "score-by-length",
        "Score after intrinsic phases of different lengths",
        "results of one controller after different lengths of play "
        "(realbench extrinsic --run-steps)",
        score_by_length.draw,
    ),
    FigureKind(
        "coverage",
        "Where objects have been between actions, on the table and on the shelf",
        "a recording whose scene's manifest is available",
        coverage.draw,
    ),
    FigureKind(
        "logged",
        "Numbers that the controller logged along the intrinsic phase",
        "a recording whose controller logs numbers (self.log)",
        logged.draw,
    ),
)


def draw_all(data: FigureData) -> dict[str, Drawing]:
    """All figures that can be drawn, by name; raises RealBenchError if none can be."""
    drawings = {kind.name: kind.draw(data) for kind in FIGURES}
    drawn = {name: drawing for name, drawing in drawings.items() if drawing is not None}
    if not drawn:
        raise RealBenchError("nothing to draw: no file has a whole action or a complete result")
    return drawn
