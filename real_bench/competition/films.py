"""Films of earlier trials: their commands, executed again."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

from real_bench.actions import check_action
from real_bench.conditions import Condition
from real_bench.goal_sets import GoalSet
from real_bench.phases.film import check_films, film_trial
from real_bench.scoring.result import Result
from real_bench.simulation import Scene
from real_bench.task import Task


def film_result(
    result: Result, goals: GoalSet, scene: Scene, folder: Path, prefix: str
) -> dict[int, str]:
    """Film every trial of a result into a folder; returns the names of the files, by goal.

    Raises:
        RealBenchError: a film cannot be made or written.
    """
    check_films()
    names = {}
    condition = Condition.parse(result.setting.condition)
    with closing(Task(scene, condition, goals.n_objects)) as task:
        for trial in result.trials:
            if trial.commands is None:
                continue
            goal = goals.goals[trial.goal]
            name = f"{prefix}-goal{trial.goal:02d}.mp4"
            task.begin(goal)
            with film_trial(task, goal, folder / name, trial.goal):
                for action in trial.commands.actions:
                    task.execute(check_action(action, task.control))
            names[trial.goal] = name
    return names
