"""How long building a planner and planning take, and what memory: 15,000 triplets.

    python evaluation/bench_planner.py [--run run.h5] [--plans 100]

Worlds are made up, so that this needs no recording: objects on a table that one action in six
pushes and the others leave, but for noise, where they are. With --run, a recording as well.
"""

from __future__ import annotations

import multiprocessing
import resource
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from real_bench.conditions import Condition
from real_bench.real_x import DynamicAbstraction, ObjectPositions, Planner, Triplets
from real_bench.recording import Experience

N_TRIPLETS = 15_000
TABLE = np.array([[-0.25, -0.45], [0.05, 0.45]])  # metres, low and high
SHARE_PUSHED = 1 / 6
PUSH_M = 0.1
NOISE_M = 1e-5
FEATURES = 7  # an object, in the latent world

MakeTriplets = Callable[[], Triplets]


@dataclass(frozen=True)
class Cost:
    """What one world took: seconds, and megabytes at the most."""

    build_s: float
    plans_s: NDArray[np.float64]
    found: float
    peak_mb: float


def walk(n_objects: int) -> Triplets:
    """Positions of objects, (x, y) each, as random pushes would leave them."""
    random = np.random.default_rng(0)
    low, high = np.tile(TABLE, n_objects)
    size = (N_TRIPLETS, n_objects)
    pushed = np.repeat(random.random(size) < SHARE_PUSHED, 2, axis=1)
    ways = np.where(pushed, PUSH_M, NOISE_M) * random.normal(size=(N_TRIPLETS, 2 * n_objects))
    path = [random.uniform(low, high)]
    for way in ways:
        path.append(np.clip(path[-1] + way, low, high))
    return Triplets(np.array(path[:-1]), np.array(path[1:]))


def latent(n_objects: int) -> Triplets:
    """The same as a smooth code of seven variables an object would show it."""
    positions = walk(n_objects)
    random = np.random.default_rng(1)
    weights = random.normal(0, 4, (2 * n_objects, FEATURES * n_objects))
    return Triplets(np.tanh(positions.states @ weights), np.tanh(positions.outcomes @ weights))


def recorded(run: Path) -> Triplets:
    """The positions in a recording."""
    return ObjectPositions().triplets(Experience(run, Condition.parse("OM")))


def measure(make: MakeTriplets, n_plans: int) -> Cost:
    """Build a planner and plan between states of the world, with 10, 9, ... actions left."""
    triplets = make()
    began = time.perf_counter()
    planner = Planner(triplets, DynamicAbstraction.learn(triplets))
    build_s = time.perf_counter() - began
    random = np.random.default_rng(2)
    pairs = random.integers(len(triplets), size=(n_plans, 2))
    noise = random.normal(0, 0.01, (n_plans, 2, triplets.n_variables))
    seconds, n_found = [], 0
    for number, ((start, end), shift) in enumerate(zip(pairs, noise, strict=True)):
        state, goal = triplets.states[[start, end]] + shift
        began = time.perf_counter()
        plan = planner.plan(state, goal, 10 - number % 10)
        seconds.append(time.perf_counter() - began)
        n_found += bool(plan.triplets)
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return Cost(build_s, np.array(seconds), n_found / n_plans, peak_mb)


@click.command()
@click.option("--run", type=click.Path(path_type=Path, exists=True))
@click.option("--plans", default=100, show_default=True)
def main(run: Path | None, plans: int) -> None:
    """Measure and print."""
    worlds: dict[str, MakeTriplets] = {
        "1 object, 2 variables": partial(walk, 1),
        "3 objects, 6 variables": partial(walk, 3),
        "latent, 14 variables": partial(latent, 2),
    }
    if run is not None:
        worlds[f"{run.name}, as recorded"] = partial(recorded, run)
    table = Table(title=f"planning with {N_TRIPLETS:,} triplets, {plans} plans each")
    for heading in ("world", "build (s)", "mean (ms)", "worst (ms)", "plans found", "peak (MB)"):
        table.add_column(heading, justify="left" if heading == "world" else "right")
    context = multiprocessing.get_context("spawn")
    for name, make in worlds.items():
        with ProcessPoolExecutor(1, mp_context=context) as pool:  # a peak of its own each
            cost = pool.submit(measure, make, plans).result()
        table.add_row(
            name,
            f"{cost.build_s:.3f}",
            f"{1e3 * cost.plans_s.mean():.1f}",
            f"{1e3 * cost.plans_s.max():.0f}",
            f"{cost.found:.0%}",
            f"{cost.peak_mb:.0f}",
        )
    Console().print(table)


if __name__ == "__main__":
    main()
