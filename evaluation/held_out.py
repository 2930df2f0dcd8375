"""How well REAL-X plans on what it makes of images, by held-out play alone: no goal set, no score.

    python evaluation/held_out.py om3.h5
    python evaluation/held_out.py om3.h5 --candidates mine.yaml --json held-out.json

Everything is learned from the first nine tenths of a play. Pairs of states of the last tenth are
then starts and goals. Each plan is followed by the true ways of the objects in the triplets that
it chose: what is left to the goal is printed (as a mean of exp(-c d), and the median), with the
share that has a plan, and the true distance between states that a plan takes for the same: from
the start to where its first triplet began, and from where its last one ended to the goal. Beside
them, how well distances of states follow true ones (Spearman, all pairs and those within 1-20 cm),
and how many latent variables are in use (0.1 nats of divergence from the prior, or more).
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from real_bench.analysis import NEAR_M, pair_distances
from real_bench.controller_code.finding import find_controller
from real_bench.errors import RealBenchError
from real_bench.inputs.yaml_files import read_mapping
from real_bench.real_x import BlurredImages, DynamicAbstraction, ObjectPositions, Planner, Triplets
from real_bench.real_x.home import plannable
from real_bench.real_x.latents import MIN_DIVERGENCE, Latents, SightSettings
from real_bench.recording import Experience, Recording
from real_bench.scoring.metric import object_scores

FILE = click.Path(path_type=Path, exists=True)
CANDIDATES = Path(__file__).with_name("perceptions.yaml")
HELD_OUT = 0.1
FAR_ENOUGH_M = 0.02
"""Pairs of states nearer than this are no task."""
N_CODE_PAIRS = 20_000

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tasks:
    """Pairs of held-out states.

    Attributes:
        starts, goals: row numbers of states, (n,).
        past: how many steps of the play may be learned from.
    """

    starts: NDArray[np.int64]
    goals: NDArray[np.int64]
    past: int


@dataclass(frozen=True)
class Quality:
    """How well planning went with one candidate; distances are metres.

    Attributes:
        score: mean of exp(-c d), d being what is left to the goal.
        left: median of what is left.
        planned: the share of tasks with a plan.
        actions: mean number of actions in a plan.
        begin, end: median true distance from the start to the first triplet's precondition, and
            from the last one's outcome to the goal.
        spearman, spearman_near: of distances of states and true ones.
        divergences: of each latent variable, nats, in descending order.
        seconds: that learning took.
    """

    score: float
    left: float
    planned: float
    actions: float
    begin: float
    end: float
    spearman: float
    spearman_near: float
    divergences: tuple[float, ...]
    seconds: float


def draw_tasks(run: Path, n: int, seed: int) -> Tasks:
    """Pairs of states of the last tenth, drawn at random."""
    whole = Experience(run, "OM")
    usable = plannable(whole)
    n_past = int(len(whole) * (1 - HELD_OUT))
    late = usable[usable >= n_past]
    where = positions(run)
    random = np.random.default_rng(seed)
    starts, goals = whole.preconditions[late], whole.outcomes[late]
    pairs = random.integers(len(late), size=(50 * n, 2))
    one, other = starts[pairs[:, 0]], goals[pairs[:, 1]]
    far = np.linalg.norm(where[one] - where[other], axis=-1).max(axis=1) > FAR_ENOUGH_M
    return Tasks(one[far][:n], other[far][:n], int(whole.durations[:n_past].sum()))


def positions(run: Path) -> Array:
    """True positions in every state, (n_states, n_objects, 3) metres."""
    with Recording(run) as recording:
        return np.asarray(recording.object_poses[:, :, :3], np.float64)


@dataclass(frozen=True)
class Followed:
    """Plans, followed by the true ways of the objects in the triplets that they chose.

    Attributes:
        left: what is left to each object's goal, (n, n_objects) metres.
        begin, end: for each plan with actions the largest true distance from the start to the first
            triplet's precondition, and from the last one's outcome to the goal, metres.
    """

    left: Array
    begin: tuple[float, ...]
    end: tuple[float, ...]


def follow(
    plans: Sequence[Sequence[int]], starts: Array, goals: Array, before: Array, after: Array
) -> Followed:
    """Follow plans between true positions, (n, n_objects, 3) metres each.

    Args:
        plans: the triplets' numbers of each.
        starts: where the objects are at first.
        goals: where they should be.
        before: where they were before each triplet's action.
        after: where they were after it.
    """
    left, begin, end = [], [], []
    for plan, start, goal in zip(plans, starts, goals, strict=True):
        chosen = list(plan)
        ends_at = start + (after[chosen] - before[chosen]).sum(axis=0)
        left.append(np.linalg.norm(ends_at - goal, axis=-1))
        if chosen:
            begin.append(float(np.linalg.norm(before[chosen[0]] - start, axis=-1).max()))
            end.append(float(np.linalg.norm(after[chosen[-1]] - goal, axis=-1).max()))
    return Followed(np.array(left), tuple(begin), tuple(end))


def judge(run: Path, tasks: Tasks, candidate: Mapping[str, Any], seed: int) -> Quality:
    """Learn from the past with one candidate, and plan between held-out states."""
    sees = "OM" if not candidate else "IM"
    past, whole = Experience(run, sees, tasks.past), Experience(run, sees)
    perception = perception_of(candidate)
    perception.seed(seed)
    began = time.monotonic()
    triplets = perception.triplets(past)
    usable = plannable(past)
    triplets = Triplets(triplets.states[usable], triplets.outcomes[usable])
    planner = Planner(triplets, DynamicAbstraction.learn(triplets))
    seconds = time.monotonic() - began
    where, n = positions(run), len(tasks.starts)
    rows = np.concatenate([tasks.starts, tasks.goals])
    states = states_at(perception, whole, where, rows)
    plans = [planner.plan(*pair).triplets for pair in zip(states[:n], states[n:], strict=True)]
    before, after = where[past.preconditions[usable]], where[past.outcomes[usable]]
    followed = follow(plans, where[tasks.starts], where[tasks.goals], before, after)
    pairs = pair_distances(triplets.states, before, N_CODE_PAIRS, np.random.default_rng(0))
    divergences = getattr(perception, "divergences", np.empty(0))
    return Quality(
        score=float(np.mean([object_scores(each).sum() for each in followed.left])),
        left=float(np.median(followed.left)),
        planned=len(followed.begin) / n,
        actions=float(np.mean([len(plan) for plan in plans if plan] or [0])),
        begin=float(np.median(followed.begin or [np.nan])),
        end=float(np.median(followed.end or [np.nan])),
        spearman=pairs.spearman,
        spearman_near=pairs.within(*NEAR_M).spearman,
        divergences=tuple(np.sort(divergences)[::-1].tolist()),
        seconds=seconds,
    )


def perception_of(candidate: Mapping[str, Any]) -> Any:
    """What makes states of images, or of positions."""
    if not candidate:
        return ObjectPositions()
    ((kind, settings),) = candidate.items()
    if kind == "images":
        images = find_controller("real_d").Settings.model_validate({"images": settings}).images
        return BlurredImages(images.width, images.height, images.blur)
    sight = SightSettings.model_validate(settings)
    return Latents(sight.eye, sight.vae)


def states_at(perception: Any, whole: Experience, where: Array, rows: NDArray[np.int64]) -> Array:
    """What a perception makes of states that it did not learn from."""
    if isinstance(perception, ObjectPositions):
        return where[rows, :, :2].reshape(len(rows), -1)
    first = dict(zip(whole.preconditions.tolist(), range(len(whole)), strict=True))
    last = dict(zip(whole.outcomes.tolist(), range(len(whole)), strict=True))
    images = [
        whole.image_before(first[row]) if row in first else whole.image_after(last[row])
        for row in rows.tolist()
    ]
    return np.array([perception.state({"retina": image}) for image in images])


@click.command(help=__doc__)
@click.argument("run", type=FILE)
@click.option("--candidates", type=FILE, default=CANDIDATES, help="YAML: settings by name.")
@click.option("--only", multiple=True, help="Only this candidate.")
@click.option("--tasks", type=int, default=300, show_default=True)
@click.option("--seed", type=int, default=0, show_default=True, help="Of the pairs and the VAE.")
@click.option("--json", "out", type=click.Path(path_type=Path), help="Write the numbers here.")
def main(
    run: Path, candidates: Path, only: tuple[str, ...], tasks: int, seed: int, out: Path | None
) -> None:
    """Print a row for each candidate."""
    logging.getLogger("real_bench").setLevel(logging.WARNING)
    drawn = draw_tasks(run, tasks, seed)
    table = Table(title=f"{run.name}: {len(drawn.starts)} tasks of held-out states")
    for heading in ("candidate", "score", "left", "planned", "actions", "begin", "end"):
        table.add_column(heading)
    for heading in ("all", "1-20 cm", "in use", "seconds"):
        table.add_column(heading)
    found = {}
    console = Console(width=140)
    for name, candidate in read_mapping(candidates, "candidates", RealBenchError).items():
        if only and name not in only:
            continue
        quality = found[name] = judge(run, drawn, candidate, seed)
        table.add_row(name, *cells(quality))
        console.print(name, *cells(quality), highlight=False)
    console.print(table)
    if out is not None:
        out.write_text(json.dumps({k: asdict(v) for k, v in found.items()}, indent=1) + "\n")


def cells(quality: Quality) -> list[str]:
    """The numbers of one row, lengths in cm."""
    lengths = [f"{100 * value:.1f} cm" for value in (quality.left, quality.begin, quality.end)]
    n_used = sum(value > MIN_DIVERGENCE for value in quality.divergences)
    return [
        f"{quality.score:.3f}",
        lengths[0],
        f"{quality.planned:.0%}",
        f"{quality.actions:.1f}",
        *lengths[1:],
        f"{quality.spearman:.3f}",
        f"{quality.spearman_near:.3f}",
        f"{n_used} of {len(quality.divergences)}" if quality.divergences else "-",
        f"{quality.seconds:.0f}",
    ]


if __name__ == "__main__":
    main()
