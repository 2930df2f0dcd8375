"""How well the object follows the hand in plays of REAL-G: numbers of docs/real_g_research.md.

    python evaluation/follows.py oc201.h5 oc202.h5

For each 500 actions about an object (those that begin nearer to it than to others): the share that
moved it by more than 1 cm. Of those in which the hand went more than 15 cm: the share after which
the object lay within 5 cm of where it would be had it followed (followed), the share in which the
hand rose by more than 5 cm before it went (rose), and the share in which both is so (carried). Of
those that were to bring it from the table to the shelf: how many did.
"""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from real_bench.conditions import Condition
from real_bench.real_g.hand import Hand, primitive_of
from real_bench.real_g.relation import Relation
from real_bench.recording import MOVED_M, Experience, Recording
from real_bench.simulation import load_scene
from real_bench.spaces import action_space

PERIOD = 500
FAR_M, FOLLOWED_M, ROSE_M = 0.15, 0.05, 0.05
SHELF_X_M, SHELF_Z_M = 0.08, 0.37
"""Beyond this x lies the shelf of scene official; above this height is what stands on it."""

Array = NDArray[np.float64]


@click.command()
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--object", "number", default=0, show_default=True, help="Which object, from 0.")
def main(files: tuple[Path, ...], number: int) -> None:
    """Print a table for each recording."""
    for file in files:
        Console(width=100).print(table(file, number))


def table(file: Path, number: int) -> Table:
    """A row for each 500 actions about an object."""
    parameters, before, after, hand = read(file, number)
    relation = Relation(hand)
    way = relation.displacement(parameters)
    moved = np.linalg.norm(after[:, :3] - before[:, :3], axis=1) > MOVED_M
    is_far = np.linalg.norm(way, axis=1) > FAR_M
    to = before[:, :2] + way
    followed = np.linalg.norm(after[:, :2] - to, axis=1) < FOLLOWED_M
    _, _, _, _, height, *_, rise = parameters[:, :10].T
    rose = is_far & (rise * (hand.high[4] - height) > ROSE_M)
    wanted = (to[:, 0] > SHELF_X_M) & (before[:, 2] < SHELF_Z_M)
    arrived = wanted & (after[:, 2] > SHELF_Z_M) & (after[:, 2] < 0.6) & (after[:, 0] < 0.3)
    found = Table(title=file.name)
    for heading in ("actions", "moved", "followed", "rose", "carried", "onto the shelf"):
        found.add_column(heading, justify="right")
    for start in range(0, len(parameters), PERIOD):
        now = slice(start, start + PERIOD)
        n_far = is_far[now].sum()
        found.add_row(
            f"{start:,} to {min(start + PERIOD, len(parameters)):,}",
            f"{moved[now].mean():.2f}",
            f"{(followed & is_far)[now].sum() / n_far:.2f}",
            f"{rose[now].sum() / n_far:.2f}",
            f"{(followed & rose)[now].sum() / n_far:.2f}",
            f"{arrived[now].sum()} of {wanted[now].sum()}",
        )
    found.caption = f"onto the shelf, all in all: {arrived.sum()} of {wanted.sum()}"
    return found


def read(file: Path, number: int) -> tuple[Array, Array, Array, Hand]:
    """Parameters of all actions about an object, and its rows before and after them."""
    with Recording(file) as recording:
        header = recording.header
        poses, rows = recording.object_poses, recording.transitions
    condition = Condition.parse(header.condition)
    hand = primitive_of(action_space(load_scene(header.scene_source), condition))
    if not isinstance(hand, Hand):
        raise click.UsageError(f"{file}: nothing is carried in {condition.name}")
    experience = Experience(file, Condition("I", condition.control))
    actions = [experience.action(n) for n in range(min(len(experience), len(rows)))]
    known = {n: p for n, p in enumerate(map(hand.parameters, actions)) if p is not None}
    if not known:
        raise click.UsageError(f"{file} has no action of the hand: its form may have changed since")
    parameters, rows = np.array(list(known.values())), rows[list(known)]
    before, after = poses[rows["precondition"]], poses[rows["outcome"]]
    starts = parameters[:, None, list(hand.start)]
    about = np.linalg.norm(before[:, :, :2] - starts, axis=2).argmin(axis=1) == number
    return parameters[about], before[about, number], after[about, number], hand


if __name__ == "__main__":
    main()
