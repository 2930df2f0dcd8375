"""Print how long first plans for 2D goals are, with and without dynamic abstraction.

python evaluation/first_plans.py --run om0.h5 --run om1.h5 --goals a.npy --goals b.npy
"""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from real_bench.conditions import Condition
from real_bench.goal_sets import load_goal_set
from real_bench.real_x import DynamicAbstraction, ObjectPositions, Planner
from real_bench.recording import Experience

FILE = click.Path(path_type=Path, exists=True)
THRESHOLDS = ((0.005, 0.01), (0.01, 0.02), (0.02, 0.04), (0.04, 0.08))


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
@click.option("--run", "runs", type=FILE, multiple=True, required=True)
@click.option("--goals", type=FILE, multiple=True, required=True)
def main(runs: tuple[Path, ...], goals: tuple[Path, ...]) -> None:
    """Print how long first plans for 2D goals are."""
    Console(width=140).print(first_plans(runs, goals))


if __name__ == "__main__":
    main()
