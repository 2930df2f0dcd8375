"""Print the means of the full-scale results, and how long first plans are.

python evaluation/full_scale.py
python evaluation/full_scale.py --run om0.h5 --run om1.h5 --goals a.npy --goals b.npy
"""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from real_bench.conditions import Condition
from real_bench.goal_sets import load_goal_set
from real_bench.goal_sets.goal import CHALLENGES
from real_bench.real_x import DynamicAbstraction, ObjectPositions, Planner
from real_bench.recording import Experience
from real_bench.scoring.result import load_result
from real_bench.scoring.statistics import mean_interval

RESULTS = Path(__file__).parent / "results" / "full-scale"
THRESHOLDS = ((0.005, 0.01), (0.01, 0.02), (0.02, 0.04), (0.04, 0.08))


def means() -> Table:
    """One row a controller and condition: the mean of its trials, by recording and by class."""
    scores: dict[str, list[tuple[str, str, float]]] = defaultdict(list)
    for path in sorted(RESULTS.glob("real_*.json")):
        name, seed = re.fullmatch(r"(.*)-seed(\d)-\w+", path.stem).groups()  # type: ignore[union-attr]
        trials = load_result(path).trials
        scores[name] += [(seed, trial.challenge, trial.score) for trial in trials]
    table = Table(title="mean scores")
    for heading in ("controller, condition, objects", "trials", "mean", "95%", "a recording each"):
        table.add_column(heading)
    for challenge in CHALLENGES:
        table.add_column(challenge)
    for name, rows in scores.items():
        seeds, classes, values = (np.array(column) for column in zip(*rows, strict=True))
        each = ", ".join(f"{values[seeds == seed].mean():.3f}" for seed in sorted(set(seeds)))
        by_class = [f"{values[classes == challenge].mean():.3f}" for challenge in CHALLENGES]
        interval = mean_interval(values)
        assert interval is not None  # a row has many trials
        spread = f"{interval.low:.3f}-{interval.high:.3f}"
        table.add_row(name, str(len(values)), f"{values.mean():.3f}", spread, each, *by_class)
    return table


def first_plans(runs: tuple[Path, ...], goal_files: tuple[Path, ...]) -> Table:
    """How many actions the first plans for 2D goals have, with and without dynamic abstraction."""
    goals = [goal for path in goal_files for goal in load_goal_set(path).goals]
    table = Table(title="first plans for 2D goals")
    for heading in ("recording", "abstraction", "plans found", "mean actions"):
        table.add_column(heading)
    for run in runs:
        triplets = ObjectPositions().triplets(Experience(run, Condition.parse("OM")))
        levels = {"dynamic": DynamicAbstraction.learn(triplets)}
        levels |= {str(pair): DynamicAbstraction.fixed(pair) for pair in THRESHOLDS}
        for name, abstraction in levels.items():
            planner = Planner(triplets, abstraction)
            lengths = [
                len(planner.plan(goal.initial_poses[0, :2], goal.final_poses[0, :2]).triplets)
                for goal in goals
                if goal.challenge == "2D"
            ]
            found = [length for length in lengths if length]
            share, mean = len(found) / len(lengths), np.mean(found)
            table.add_row(run.name, name, f"{share:.0%}", f"{mean:.2f}")
    return table


@click.command()
@click.option("--run", "runs", type=click.Path(path_type=Path, exists=True), multiple=True)
@click.option("--goals", type=click.Path(path_type=Path, exists=True), multiple=True)
def main(runs: tuple[Path, ...], goals: tuple[Path, ...]) -> None:
    """Print the means, and first plans where recordings and goals are given."""
    console = Console(width=140)
    console.print(first_plans(runs, goals) if runs and goals else means())


if __name__ == "__main__":
    main()
