"""Verify a result: its trials by replay, and everything else it says."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from real_bench.conditions import Condition
from real_bench.errors import GoalSetError, Interrupted, ResultError
from real_bench.goal_sets import GoalSet, load_goal_set, shipped_goal_set
from real_bench.inputs.whole import keep_whole
from real_bench.phases.stopping import StopRequest, stop_requests
from real_bench.phases.workers import in_processes
from real_bench.scoring.result import Result, Setting, TrialResult, parse_content
from real_bench.scoring.result_file import read_content
from real_bench.simulation.scene import Scene, load_scene, shipped_scenes
from real_bench.text.counting import counted
from real_bench.text.quoting import quoted
from real_bench.verification.result_checks import ResultChecks
from real_bench.verification.trials import TrialReplayer
from real_bench.verification.verdicts import ResultVerdict, TrialCheck
from real_bench.verification.versions import Physics

OnReplay = Callable[[int, int], None]


class NotGivenError(ResultError):
    """What it takes to verify a result was not given: its goals, or its scene."""


@dataclass(frozen=True)
class ResultVerification:
    """A result to be verified.

    Attributes:
        path: the result.
        goals: its goal set; None: the shipped one.
        scene: its scene, a name or manifest; None: the shipped one of its name.
        run: the recording that was learned from, to check it as well.
        controller: the controller that was tested, to check it as well; its code is not run.
        may_be_incomplete: whether a result with missing trials passes.
        jobs: number of processes.
    """

    path: Path
    goals: Path | None = None
    scene: str | None = None
    run: Path | None = None
    controller: str | None = None
    may_be_incomplete: bool = False
    jobs: int = 1

    def __post_init__(self) -> None:
        keep_whole(self, "jobs", 1, error=ResultError)

    def verify(self, report: OnReplay) -> ResultVerdict:
        """Replay every trial.

        Args:
            report: called at first and after each trial with the trials replayed and their total.

        Raises:
            ResultError: it cannot be read or contradicts itself, has no commands, or goals or
                scene are not its own.
            Interrupted: the user stopped it.
            RealBenchError: goals, scene or recording cannot be read.
        """
        content = read_content(self.path)
        result = parse_content(content, self.path)
        self._check_replayable(result)
        condition = Condition.parse(result.setting.condition)
        if mismatch := condition.control_mismatch(result.setting.control_version):
            raise ResultError(f"{self.path} cannot be replayed: {mismatch}")
        scene = self._scene(result.setting)
        goal_set = self._goal_set(result.setting, scene)
        physics = Physics.of(result.setting.versions)
        claims = ResultChecks(content, result, scene, goal_set)
        claims.check(self.run, self.controller)
        make = partial(
            TrialReplayer,
            scene,
            condition,
            goal_set,
            result.setting.trial_steps,
            physics.differs,
        )
        checks = []
        with stop_requests() as stop:
            report(0, len(result.trials))
            for check in self._checks(make, result.trials, stop):
                checks.append(check)
                report(len(checks), len(result.trials))
            if len(checks) < len(result.trials):
                raise Interrupted(f"stopped after {len(checks)} of {len(result.trials)} trials")
        return ResultVerdict(
            path=self.path,
            score=result.score,
            n_trials=len(result.setting.goal_numbers),
            checks=tuple(sorted(checks, key=lambda check: check.goal)),
            faults=tuple(claims.faults),
            notes=(*claims.notes, *physics.notes()),
            physics=physics,
            may_be_incomplete=self.may_be_incomplete,
        )

    def _check_replayable(self, result: Result) -> None:
        if not result.trials:
            raise ResultError(f"{self.path} has no trial yet: nothing to verify")
        if not result.keeps_commands:
            raise ResultError(
                f"{self.path} is too old to be replayed, it keeps no commands: "
                "test again to get a result that can be verified"
            )

    def _scene(self, setting: Setting) -> Scene:
        if self.scene is None and setting.scene not in shipped_scenes():
            raise NotGivenError(
                f"scene {quoted(setting.scene)} of {self.path} does not ship with realbench: "
                "give its manifest with --scene"
            )
        scene = load_scene(setting.scene if self.scene is None else self.scene)
        if scene.sha256 != setting.scene_sha256:
            raise ResultError(
                f"{self.path} is of scene {quoted(setting.scene)} "
                f"({quoted(setting.scene_sha256[:12])}), "
                f"not of this {scene.name} ({scene.sha256[:12]})"
            )
        return scene

    def _goal_set(self, setting: Setting, scene: Scene) -> GoalSet:
        goal_set = load_goal_set(self.goals or self._shipped_goals(setting))
        if goal_set.sha256 != setting.goals_sha256:
            which = str(self.goals) if self.goals else "the shipped ones"
            kind = ResultError if self.goals else NotGivenError
            raise kind(
                f"{self.path} is on goals {quoted(setting.goals_sha256[:12])}, not on {which} "
                f"({goal_set.sha256[:12]}): give its goals with --goals"
            )
        goal_set.check_fits(scene, setting.objects)
        largest = max(setting.goal_numbers, default=0)
        if setting.n_goals not in (None, len(goal_set)) or largest >= len(goal_set):
            size = counted(max(setting.set_size, largest + 1), "goal")
            raise ResultError(f"{self.path} is on a set of {size}, this one has {len(goal_set)}")
        return goal_set

    def _shipped_goals(self, setting: Setting) -> Path:
        try:
            return shipped_goal_set(setting.objects, setting.scene)
        except GoalSetError as error:
            raise NotGivenError(
                f"{self.path} is not on goals that ship: give its goals with --goals"
            ) from error

    def _checks(
        self, make: Callable[[], TrialReplayer], trials: tuple[TrialResult, ...], stop: StopRequest
    ) -> Iterator[TrialCheck]:
        jobs = min(self.jobs, len(trials))
        if jobs > 1:
            yield from in_processes(partial(_checker, make), trials, jobs, stop, "try again")
            return
        with closing(make()) as replayer:
            for trial in trials:
                if stop.requested:
                    return
                yield replayer.check(trial)


def _checker(make: Callable[[], TrialReplayer]) -> Callable[[TrialResult], TrialCheck]:
    return make().check
