"""How well a robot that is told no positions sees where objects are, by what it played.

Plays a recording back to the perception of REAL-G, image by image, and compares its rows with the
ground truth, which it never sees; at last on the images of a goal set, which played no part.

    realbench intrinsic --controller real_r --condition OM --images --steps 1000000 --seed 11 \
        --out run.h5
    realbench goals generate --seed 9001 --out goals.npy
    python evaluation/perception.py run.h5 goals.npy --after 100 300 1000
"""

from __future__ import annotations

import argparse
import itertools
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.conditions import Condition
from real_bench.goal_sets import GoalSet, load_goal_set
from real_bench.real_g import primitive_of
from real_bench.real_g.image_objects import ImageObjects
from real_bench.real_x.home import is_home
from real_bench.recording import Experience, Recording
from real_bench.simulation import load_scene
from real_bench.task import Task

Array = NDArray[np.float64]

SHELF_M = 0.06
"""Where the shelf begins, in x."""

DEPTHS = 100
"""Images of which depth is taken again: it is not recorded, and changes only what lies around."""


def main() -> None:
    """Print a line for each number of actions, and one for the goals."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("goals", type=Path)
    parser.add_argument("--after", type=int, nargs="+", default=[500, 1000, 3000])
    parser.add_argument("--no-depth", action="store_true", help="as if no depth were observed")
    given = parser.parse_args()
    with Recording(given.run) as recording:
        header = recording.header
        condition = Condition.parse(header.condition)
        poses, joints = recording.object_poses, recording.states["joint_positions"]
    task = Task(load_scene(header.scene_source), condition, header.objects)
    experience = Experience(given.run, condition)
    goals = load_goal_set(given.goals)
    objects = fresh(task, poses, with_depth=not given.no_depth)
    primitive, home = primitive_of(task.action_space), is_home(joints)
    seconds, moment = 0.0, 0

    def look(image: NDArray[np.uint8]) -> Array:
        nonlocal seconds, moment
        began = time.process_time()
        objects.see(image if home[moment] else None)
        if moment < len(experience):
            parameters = primitive.parameters(experience.action(moment))
            if parameters is not None:
                objects.act(primitive.path(parameters))
        seconds += time.process_time() - began
        moment += 1
        if moment in given.after or moment == experience.n_states:
            report(moment, seconds, objects, poses[:moment, :, :3], goals)
        return np.zeros(0)

    experience.map_images(look)
    task.close()


def fresh(task: Task, poses: Array, *, with_depth: bool) -> ImageObjects:
    """A perception with the ground that depth images of some moments show."""
    primitive = primitive_of(task.action_space)
    ends = list(primitive.end)
    objects = ImageObjects(primitive.low[ends], primitive.high[ends])
    if with_depth:
        for number in np.linspace(0, len(poses) - 1, DEPTHS).astype(int):
            task.begin(object_poses=poses[number])
            objects.see_depth(task.observe()["depth"])
    return objects


def report(n: int, seconds: float, objects: ImageObjects, truth: Array, goals: GoalSet) -> None:
    """One line for what was seen at play, one for goals."""
    rows = objects.rows()
    print(f"{n:,} moments, {1000 * seconds / n:.1f} ms of CPU each, {rows.shape[1]} objects known")
    if not rows.shape[1]:
        return
    order = match_objects(rows, truth)
    began = time.process_time()
    seen = np.array([objects.look(goal.retina) for goal in goals.goals])
    seconds_each = (time.process_time() - began) / len(seen)
    print("  play   ", errors(rows, truth, order))
    asked = np.array([goal.final_poses[:, :3] for goal in goals.goals])
    print("  goals  ", errors(seen, asked, order), f"({1000 * seconds_each:.1f} ms of CPU each)")


def match_objects(rows: Array, truth: Array) -> tuple[int, ...]:
    """Which object each row is of: its order is its own, so that with the least error counts."""
    k = rows.shape[1]

    def error(order: tuple[int, ...]) -> float:
        away = rows[:, : len(order), :2] - truth[:, list(order), :2]
        return float(np.nanmedian(np.linalg.norm(away, axis=2)))

    n = truth.shape[1]
    return min(itertools.permutations(range(n), min(k, n)), key=error)


def errors(rows: Array, truth: Array, order: tuple[int, ...]) -> str:
    """Median and 90% of the error in x, y on table and shelf, who is who, and what is not seen."""
    mine, his = rows[:, : len(order)], truth[:, list(order)]
    away = 100 * np.linalg.norm(mine[..., :2] - his[..., :2], axis=2)
    shelf, seen = his[..., 0] > SHELF_M, ~np.isnan(away)
    nearest = np.linalg.norm(mine[:, :, None, :2] - truth[:, None, :, :2], axis=3).argmin(axis=2)
    right = (nearest == np.array(order))[seen].mean()
    descriptions = [
        f"{name} {part.sum()}: {format_quantiles(away[part & seen])}"
        for name, part in (("table", ~shelf), ("shelf", shelf))
    ]
    return (
        f"{', '.join(descriptions)}; who is who right {right:.1%}, not seen {1 - seen.mean():.1%}"
    )


def format_quantiles(values: NDArray[Any]) -> str:
    """Median and 90%, in cm."""
    if not len(values):
        return "-"
    return " and ".join(f"{value:.1f}" for value in np.quantile(values, [0.5, 0.9])) + " cm"


if __name__ == "__main__":
    main()
