"""Let a submission do again, isolated, what a bundle says it did."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from real_bench.conditions import Condition
from real_bench.counting import counted
from real_bench.errors import ResultError
from real_bench.goal_sets import GoalSet, load_goal_set, shipped_goal_set
from real_bench.locks import temporary_folder
from real_bench.phases.handover import Wanted
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.proxy import Identity
from real_bench.phases.trial import TrialMaker, TrialPlan
from real_bench.recording import Recording
from real_bench.recording.state import is_same_state
from real_bench.sandbox import Limits, SandboxBackend
from real_bench.scoring.result import Result
from real_bench.simulation import load_scene
from real_bench.verification.bundles import Bundle
from real_bench.verification.parts import FAILS, HOLDS, NOT_CHECKED, PartOutcome

LEARNS_OTHERWISE = (
    "after learning again from the recording it acts differently: its state is from another play, "
    "or holds what no recording shows (--play-again decides)"
)


def check_actions(
    result: Result, bundle: Bundle, goals: Path | None, scene: str | None, n: int, limits: Limits
) -> PartOutcome:
    """Whether the submission acts in trials as the result says, and its state follows from play.

    It is tested again on the first goals: with the state that it handed over, and with one that it
    learns again from the recording; the commands must be the same. If it does not act the same
    twice, nothing can be concluded.

    Returns:
        A verdict, and why.

    Raises:
        RealBenchError: the submission cannot be run.
    """
    wanted: Wanted | None
    first = sorted(result.trials, key=lambda trial: trial.goal)[:n]
    if not first:
        return NOT_CHECKED, "no goal has been tested"
    recorded = [trial.actions_sha256 for trial in first]
    tests = _Tests(result, bundle, goals, scene, tuple(trial.goal for trial in first), limits)
    identity = tests.identity
    learns = identity.learns_from_experience or result.setting.learned is not None
    if learns and result.setting.run_steps and bundle.recording is None:
        return NOT_CHECKED, "the recording that it learned from is not here"
    if result.setting.learned is not None or bundle.recording is None:
        wanted = None
    else:
        wanted = "again" if identity.learns_from_experience else "nothing"
    if (acts := tests.commands(wanted)) != recorded:
        if tests.commands(wanted) != acts:
            return NOT_CHECKED, "it does not act the same twice"
        return FAILS, "tested again, the submission acts differently: these are not its commands"
    goals_text = counted(len(recorded), "goal")
    if bundle.recording is None:
        return HOLDS, f"it acts the same again ({goals_text})"
    if not identity.learns_from_experience:
        return NOT_CHECKED, (
            f"it acts the same again ({goals_text}), but cannot learn again: it has no "
            "use_experience() (--play-again lets it play)"
        )
    if result.setting.learned is None:
        return HOLDS, f"it learns the same from the recording ({goals_text})"
    again = tests.commands("again")
    if again == recorded:
        return HOLDS, f"it learns the same again from the recording ({goals_text})"
    if tests.commands("again") != again:
        return NOT_CHECKED, "its learning is not repeatable"
    return FAILS, LEARNS_OTHERWISE


def check_play(bundle: Bundle, scene: str | None, limits: Limits) -> PartOutcome:
    """Whether the submission plays as recorded, and hands over the same state.

    Returns:
        A verdict, and why.

    Raises:
        RealBenchError: the submission cannot be run.
    """
    if bundle.recording is None or bundle.submission is None:
        return NOT_CHECKED, "recording or submission not found"
    with Recording(bundle.recording) as recording, temporary_folder("realbench-again-") as folder:
        header = recording.header
        if recording.cuts:
            return (
                NOT_CHECKED,
                "the play was interrupted and resumed, so it cannot be repeated exactly",
            )
        phase = IntrinsicPhase(
            controller=str(bundle.submission),
            condition=Condition.parse(header.condition),
            objects=header.objects,
            scene=load_scene(scene or header.scene_source),
            steps=recording.total_steps,
            seed=header.seed,
            out=folder / "again.h5",
            images=header.images,
            settings=header.settings,
            backend=SandboxBackend((bundle.result.parent,), limits),
        )
        phase.run(lambda progress: None).close()
        with Recording(phase.out) as again:
            if again.commands_sha256 != recording.commands_sha256:
                return FAILS, "it plays differently: this play is not its own, or not repeatable"
            if not is_same_state(recording.controller_state(), again.controller_state()):
                return FAILS, "it plays the same, but hands over another state"
    return HOLDS, "it plays the same and hands over the same state"


class _Tests:
    """Repeatable tests on some goals of a result."""

    def __init__(
        self,
        result: Result,
        bundle: Bundle,
        goals: Path | None,
        scene: str | None,
        numbers: tuple[int, ...],
        limits: Limits,
    ) -> None:
        assert bundle.submission is not None
        self._setting, self._bundle, self._numbers = result.setting, bundle, numbers
        self._goals = _goal_set(result, goals)
        self._scene = load_scene(scene or self._setting.scene)
        self._controller = str(bundle.submission)
        files = (bundle.result, *([bundle.recording] if bundle.recording else []))
        self._backend = SandboxBackend((*files, *([goals] if goals else [])), limits)

    @property
    def identity(self) -> Identity:
        """What the submission is."""
        return self._backend.identity(self._controller, self._setting.settings)

    def commands(self, wanted: Wanted | None) -> list[str]:
        """The hashes of what it commands in each trial."""
        return list(self._run_trials(wanted))

    def _run_trials(self, wanted: Wanted | None) -> Iterator[str]:
        setting, run = self._setting, self._bundle.recording
        plan = TrialPlan(
            controller=self._controller,
            condition=Condition.parse(setting.condition),
            scene=self._scene,
            goal_set=self._goals,
            seed=setting.seed,
            trial_steps=setting.trial_steps,
            run=run,
            run_steps=_learned_steps(run, setting.run_steps),
            settings=setting.settings,
            wanted=wanted,
            backend=self._backend,
        )
        with closing(TrialMaker(plan, given=plan.handover(self.identity))) as maker:
            for number in self._numbers:
                yield maker.make(number)[0].actions_sha256


def _goal_set(result: Result, goals: Path | None) -> GoalSet:
    setting = result.setting
    goal_set = load_goal_set(goals or shipped_goal_set(setting.objects, setting.scene))
    if goal_set.sha256 != setting.goals_sha256:
        raise ResultError("the result is on other goals")
    return goal_set


def _learned_steps(run: Path | None, steps: int) -> int | None:
    """How many steps it learned from; None: all."""
    if run is None:
        return None
    with Recording(run) as recording:
        return None if recording.n_steps == steps else steps
