"""The official evaluation: play, then goals in order, with one controller in this process."""

from __future__ import annotations

import inspect
import logging
import math
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from real_bench.errors import ControllerError
from real_bench.goal_sets.goal import CHALLENGES
from real_bench.inputs.whole import whole
from real_bench.lengths import INTRINSIC_STEPS, TRIAL_STEPS

if TYPE_CHECKING:
    from real_bench.goal_sets import GoalSet
    from real_bench.phases.proxy import ControllerProxy
    from real_bench.simulation.scene import Scene
    from real_bench.task import Task

SEED = 0

Scores = tuple[dict[str, float], dict[str, list[float]]]

log = logging.getLogger(__name__)


def evaluate(
    Controller: type[Any],  # noqa: N803  the official name
    environment: str = "R1",
    action_type: str = "macro_action",
    n_objects: int = 1,
    intrinsic_timesteps: float = INTRINSIC_STEPS,
    extrinsic_timesteps: float = TRIAL_STEPS,
    extrinsic_trials: int = 50,
    visualize: bool = True,
    goals_dataset_path: str | Path = "./goals.npy.npz",
    video: object = None,
) -> Scores:
    """Play and test as the official package does; nothing is written.

    Args:
        Controller: the class; it is seeded with 0.
        environment: R1 (positions are observed) or R2.
        action_type: joints, cartesian or macro_action.
        n_objects: 1 to 3.
        intrinsic_timesteps: steps of free play.
        extrinsic_timesteps: steps of each trial.
        extrinsic_trials: how many goals, starting with the first.
        visualize: open pybullet's window.
        goals_dataset_path: an official goal file, or one of realbench.
        video: ignored (use ``realbench extrinsic --video``).

    Returns:
        the mean scores (``score_2D``, ``score_2.5D``, ``score_3D``, 0 where there is no such goal,
        and ``score_total``), and each class's scores in the order of the goals.

    Raises:
        ControllerError: the controller failed; its own exception is the cause.
        RealBenchError: an argument is wrong.
    """
    from real_bench.compat.class_source import ClassSource
    from real_bench.compat.names import official_condition
    from real_bench.phases.local import LocalProxy
    from real_bench.simulation import load_scene
    from real_bench.task import Task

    if not (inspect.isclass(Controller) and callable(getattr(Controller, "step", None))):
        raise ControllerError(f"a class with step() was expected, not {Controller!r}")
    play_steps = whole(intrinsic_timesteps, "intrinsic_timesteps")
    trial_steps = whole(extrinsic_timesteps, "extrinsic_timesteps", 1)
    n_trials = whole(extrinsic_trials, "extrinsic_trials")
    if video:
        log.warning("video is ignored: to film each trial, use realbench extrinsic --video")
    condition, scene = official_condition(environment, action_type), load_scene("official")
    goals = _goals(Path(goals_dataset_path), scene, n_objects, n_trials)
    task = Task(scene, condition, n_objects, gui=visualize)
    try:
        proxy = LocalProxy(ClassSource.of_class(Controller), Controller, {}, task)
        proxy.seed(SEED)
        _play(proxy, task, play_steps)
        return _run_trials(proxy, task, goals, trial_steps, n_trials)
    finally:
        task.close()


def read_goals(path: Path, scene: Scene) -> GoalSet:
    """An official goal file (.npz), or one of realbench; raises GoalSetError."""
    from real_bench.goal_sets import load_goal_set
    from real_bench.goal_sets.official import import_official

    return import_official(path, scene) if path.suffix == ".npz" else load_goal_set(path)


def _goals(path: Path, scene: Scene, n_objects: int, n_trials: int) -> GoalSet | None:
    if n_trials == 0:
        return None
    goals = read_goals(path, scene)
    goals.check_fits(scene, n_objects)
    whole(n_trials, "extrinsic_trials", 0, len(goals))
    return goals


def _play(proxy: ControllerProxy, task: Task, n_steps: int) -> None:
    from real_bench.phases.player import make_player

    if n_steps == 0:
        return
    task.begin()
    proxy.call("start_intrinsic_phase")
    player = make_player(proxy, task)
    while task.n_steps < n_steps:
        player.play(n_steps - task.n_steps)
    proxy.call("end_intrinsic_phase", player.look(), 0, True)


def _run_trials(
    proxy: ControllerProxy, task: Task, goals: GoalSet | None, trial_steps: int, n_trials: int
) -> Scores:
    from real_bench.phases.trial import TrialMaker, TrialPlan

    scores: dict[str, list[float]] = {}
    if goals is None:
        proxy.call("start_extrinsic_phase")
        proxy.call("end_extrinsic_phase")
        proxy.close()
    else:
        scene, name = task.simulation.scene, proxy.spec
        plan = TrialPlan(name, task.condition, scene, goals, SEED, trial_steps)
        with closing(TrialMaker(plan, proxy, task=task)) as maker:
            for number in range(n_trials):
                trial, _ = maker.make(number)
                log.info("goal %d (%s): %.4f", number, trial.challenge, trial.score)
                scores.setdefault(trial.challenge, []).append(trial.score)
            maker.end()
    every = [score for name in CHALLENGES for score in scores.get(name, [])]
    means = {f"score_{name}": _mean(scores[name]) if name in scores else 0 for name in CHALLENGES}
    return {**means, "score_total": _mean(every) if every else math.nan}, scores


def _mean(scores: list[float]) -> float:
    import numpy as np

    return float(np.mean(scores))
