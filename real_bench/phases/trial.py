"""One trial of the extrinsic phase: from the goal's start, for 10,000 steps."""

from __future__ import annotations

import io
import time
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action
from real_bench.conditions import Condition
from real_bench.errors import (
    ControllerDeclinedError,
    ControllerFailedError,
    PhysicsError,
    RealBenchError,
)
from real_bench.files.atomic import write_atomically
from real_bench.files.outputs import check_folder
from real_bench.goal_sets import Goal, GoalSet, trial_strip
from real_bench.inputs.numeric import short
from real_bench.inputs.whole import keep_whole
from real_bench.lengths import LARGEST, MAX_TRIAL_STEPS
from real_bench.phases.activity import LEARNING, PLANNING, Activity, ignore_activity
from real_bench.phases.explaining import Explainer
from real_bench.phases.film import check_films, film_trial
from real_bench.phases.handover import NOTHING, Handover, Wanted, load_handover
from real_bench.phases.local import LocalBackend
from real_bench.phases.player import Player, make_player
from real_bench.phases.proxy import ControllerBackend, ControllerProxy, Identity, close_on_error
from real_bench.phases.seeds import derived_seed
from real_bench.recording import Experience, Recording
from real_bench.scoring.commands import Commands
from real_bench.scoring.metric import distances
from real_bench.scoring.result import TrialResult
from real_bench.simulation.scene import Scene
from real_bench.task import Task
from real_bench.text.naming import trial_name


@dataclass(frozen=True)
class TrialPlan:
    """All that a process needs to run trials.

    Attributes:
        controller: name, ``module:Class`` or file.
        condition, scene: of the test.
        goal_set: the goals to choose from.
        seed: each trial's own seed follows from it and the goal's number.
        trial_steps: length of a trial.
        run: the recording that the controller learns from, where there is one.
        run_steps: how many of its first steps it learns from; None: all. With fewer than all it
            learns again, since what it learned at play came from all of them.
        settings: values for the controller's settings; the rest are its defaults.
        videos, pictures: folders for a film, and for a picture, of each trial.
        explanations: folder for what a controller says of each of its decisions.
        wanted: what to do if a recording holds what other code or settings learned, or
            nothing; see :mod:`real_bench.phases.handover`.
        backend: where the controller runs.
    """

    controller: str
    condition: Condition
    scene: Scene
    goal_set: GoalSet
    seed: int
    trial_steps: int
    run: Path | None = None
    run_steps: int | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    videos: Path | None = None
    pictures: Path | None = None
    explanations: Path | None = None
    wanted: Wanted | None = None
    backend: ControllerBackend = field(default_factory=LocalBackend)

    def __post_init__(self) -> None:
        keep_whole(self, "seed", 0, LARGEST)
        keep_whole(self, "trial_steps", 1, MAX_TRIAL_STEPS)
        if self.run_steps is not None:
            keep_whole(self, "run_steps", 1, LARGEST)
            if self.run is None:
                raise RealBenchError("--run-steps needs --run: there is no recording to learn from")
        if self.wanted is not None and self.wanted not in get_args(Wanted):
            raise RealBenchError(
                f"what it learned: {short(self.wanted)} is not one of {', '.join(get_args(Wanted))}"
            )

    def check_recording(self) -> None:
        """Raise RealBenchError if the recording, which must exist by now, does not fit the test."""
        if self.run is None:
            return
        with Recording(self.run) as recording:
            header, n_steps = recording.header, recording.n_steps
        header.check_fits(self.run, self.condition, self.goal_set.n_objects, self.scene.sha256)
        if self.run_steps is not None and self.run_steps > n_steps:
            raise RealBenchError(
                f"{self.run} has {n_steps:,} steps, {self.run_steps:,} were asked for"
            )

    def handover(self, identity: Identity) -> Handover:
        """What the controller continues from: nothing if it learns from a part of the recording.

        Raises ControllerError if it is unclear what to do.
        """
        if self.run is None:
            return NOTHING
        return load_handover(
            self.run, self.controller, identity, self.condition, self.wanted, self.run_steps
        )

    def check_outputs(self) -> None:
        """Find out before any work is done whether films, pictures and explanations can be kept.

        Raises:
            RealBenchError: they cannot.
        """
        for folder in (self.videos, self.pictures, self.explanations):
            if folder is not None:
                check_folder(folder, make=True)
        if self.videos is not None:
            check_films()


class TrialMaker:
    """Runs trials with one controller in one world.

    Args:
        plan: what is tested.
        proxy: the controller as the intrinsic phase left it; None: make a new one.
        given: what a new one continues from.
        task: the world of the intrinsic phase; None: make a new one.
        activity: called with what the controller is busy with.
    """

    def __init__(
        self,
        plan: TrialPlan,
        proxy: ControllerProxy | None = None,
        given: Handover = NOTHING,
        task: Task | None = None,
        activity: Activity = ignore_activity,
    ) -> None:
        self._plan, self._activity = plan, activity
        self._task = task or Task(plan.scene, plan.condition, plan.goal_set.n_objects)
        self._proxy = self._prepare_proxy(given) if proxy is None else proxy
        with close_on_error(self._proxy), activity(LEARNING):
            if plan.run is not None:
                experience = Experience(plan.run, plan.condition, plan.run_steps)
                self._proxy.call("use_experience", experience)
            self._proxy.call("start_extrinsic_phase")
        # whether one controller meets goal after goal
        self.in_order = self._proxy.identity.learns_across_trials

    def make(self, number: int) -> tuple[TrialResult, float]:
        """Test one goal; returns the result and the seconds it took."""
        began = time.monotonic()
        try:
            result = self._trial(number)
        except ControllerDeclinedError as error:  # too late for that
            raise ControllerFailedError(f"goal {number}: {error}") from error
        except (PhysicsError, ControllerFailedError) as error:
            raise type(error)(f"goal {number}: {error}") from error
        return result, time.monotonic() - began

    def end(self) -> None:
        """Tell a controller that met goal after goal that there are no more."""
        if self.in_order:
            self._proxy.call("end_extrinsic_phase")

    def close(self) -> None:
        """Let go of controller and world."""
        self._proxy.close()
        self._task.close()

    def _prepare_proxy(self, given: Handover) -> ControllerProxy:
        plan = self._plan
        proxy = plan.backend.proxy(plan.controller, plan.settings, self._task, given.files)
        with close_on_error(proxy):
            proxy.seed(plan.seed)
            proxy.set_state(given.state)
        return proxy

    def _trial(self, number: int) -> TrialResult:
        plan, task, goal = self._plan, self._task, self._plan.goal_set.goals[number]
        proxy = self._proxy if self.in_order else self._proxy.copy()
        task.begin(goal)
        start = task.simulation.image().retina if plan.pictures else None
        proxy.seed(derived_seed(plan.seed, number))
        film = plan.videos / f"{trial_name(number)}.mp4" if plan.videos else None
        with film_trial(task, goal, film, number):
            proxy.call("start_extrinsic_trial")
            explainer = Explainer(task, goal) if plan.explanations else None
            player = make_player(proxy, task, partial(self._activity, PLANNING))
            actions = self._play(player, proxy, explainer)
        proxy.call("end_extrinsic_trial", player.look(), 0, True)
        if not self.in_order:
            proxy.call("end_extrinsic_phase")
            proxy.close()
        result = trial_result(number, goal, task.simulation.object_poses(), Commands.of(actions))
        if plan.explanations and explainer:
            explainer.save(plan.explanations, trial_name(number))
        if plan.pictures is not None and start is not None:
            self._draw(plan.pictures, result, goal, start)
        return result

    def _play(
        self, player: Player, proxy: ControllerProxy, explainer: Explainer | None
    ) -> list[Action]:
        actions: list[Action] = []
        while self._task.n_steps < self._plan.trial_steps:
            with explainer.decision(proxy) if explainer else nullcontext():
                actions.append(player.play(self._plan.trial_steps - self._task.n_steps))
        return actions

    def _draw(
        self, folder: Path, result: TrialResult, goal: Goal, start: NDArray[np.uint8]
    ) -> None:
        end = self._task.simulation.image().retina
        title = f"goal {result.goal} ({goal.challenge}): score {result.score:.3f}"
        stream = io.BytesIO()
        trial_strip(start, goal.retina, end, title).save(stream, "png")
        write_atomically(folder / f"{trial_name(result.goal)}.png", stream.getvalue())


def trial_result(
    number: int, goal: Goal, poses: NDArray[np.float64], commands: Commands
) -> TrialResult:
    """What is kept of a trial.

    Args:
        number: of the goal.
        goal: the goal itself.
        poses: where the objects ended, (n_objects, 7).
        commands: all that was executed.
    """
    away = distances(poses[:, :3], goal.final_poses[:, :3])
    return TrialResult(
        goal=number,
        challenge=goal.challenge,
        distances=tuple(away.tolist()),
        final_poses=tuple(tuple(pose) for pose in poses.tolist()),
        actions_sha256=commands.sha256,
        commands=commands,
    )
