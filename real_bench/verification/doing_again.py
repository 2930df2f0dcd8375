"""Let a submission do again, isolated, what a bundle says it did."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from random import SystemRandom

from real_bench.conditions import Condition
from real_bench.controller_code.manifest import read_submission
from real_bench.controller_code.requirements import packages_of
from real_bench.errors import RealBenchError, ResultError, SubmissionError
from real_bench.files.locks import temporary_folder
from real_bench.goal_sets import GoalSet, load_goal_set, shipped_goal_set
from real_bench.phases.handover import Wanted
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.proxy import Identity
from real_bench.phases.trial import TrialMaker, TrialPlan
from real_bench.recording import Recording
from real_bench.recording.state import is_same_state
from real_bench.sandbox import Limits, SandboxBackend
from real_bench.scoring.result import Result, TrialResult
from real_bench.simulation import load_scene
from real_bench.text.counting import counted
from real_bench.verification.bundles import Bundle
from real_bench.verification.parts import (
    DISPUTED,
    FAILS,
    HOLDS,
    NOT_CHECKED,
    UNDECIDED,
    PartOutcome,
)
from real_bench.verification.versions import Physics


def check_actions(
    result: Result, bundle: Bundle, goals: Path | None, scene: str | None, n: int, limits: Limits
) -> PartOutcome:
    """Whether the submission acts in trials as the result says, and its state follows from play.

    It is tested again on some goals: with the state that it handed over, and with one that it
    learns again from the recording; the commands must be the same. If it does not act the same
    twice, nothing can be concluded.

    Returns:
        A verdict, and why.

    Raises:
        RealBenchError: the submission cannot be run.
    """
    wanted: Wanted | None
    if not result.trials:
        return NOT_CHECKED, "no goal has been tested"
    tests = _Tests(result, bundle, goals, scene, limits)
    identity = tests.identity
    drawn = draw_trials(result.trials, n, in_order=identity.learns_across_trials)
    recorded = [trial.actions_sha256 for trial in drawn]
    numbers = [trial.goal for trial in drawn]
    on_goals = f"{counted(len(drawn), 'goal')}: {', '.join(map(str, numbers))}"
    learns = identity.learns_from_experience or result.setting.learned is not None
    if learns and result.setting.run_steps and bundle.recording is None:
        return NOT_CHECKED, "the recording that it learned from is not here"
    if result.setting.learned is not None or bundle.recording is None:
        wanted = None
    else:
        wanted = "again" if identity.learns_from_experience else "nothing"
    if (acts := tests.commands(numbers, wanted)) != recorded:
        if tests.commands(numbers, wanted) != acts:
            return NOT_CHECKED, f"it does not act the same twice ({on_goals})"
        return _differs(
            result.setting.versions,
            "tested again, the submission acts differently: these are not its commands "
            f"({on_goals})",
        )
    if bundle.recording is None:
        return HOLDS, f"it acts the same again ({on_goals})"
    if not identity.learns_from_experience:
        return NOT_CHECKED, (
            f"it acts the same again ({on_goals}), but cannot learn again: it has no "
            "use_experience() (--play-again lets it play)"
        )
    if result.setting.learned is None:
        return HOLDS, f"it learns the same from the recording ({on_goals})"
    again = tests.commands(numbers, "again")
    if again == recorded:
        return HOLDS, f"it learns the same again from the recording ({on_goals})"
    if tests.commands(numbers, "again") != again:
        return NOT_CHECKED, f"its learning is not repeatable ({on_goals})"
    return _differs(
        result.setting.versions,
        "after learning again from the recording it acts differently: its state is from another "
        f"play, or holds what no recording shows; --play-again decides ({on_goals})",
        DISPUTED,
    )


def draw_trials(trials: Sequence[TrialResult], n: int, *, in_order: bool) -> list[TrialResult]:
    """Some trials by the number of their goal, drawn anew each time, so that nobody knows which.

    Args:
        trials: all that there are.
        n: how many to draw; all if there are no more.
        in_order: whether each depends on those before it: then it is the first ones.
    """
    by_goal = sorted(trials, key=lambda trial: trial.goal)
    if in_order:
        return by_goal[:n]
    drawn = SystemRandom().sample(range(len(by_goal)), min(n, len(by_goal)))
    return [by_goal[number] for number in sorted(drawn)]


def check_play(bundle: Bundle, scene: str | None, limits: Limits) -> PartOutcome:
    """Whether the submission plays as recorded, and hands over the same state.

    If either differs, it plays once more; if that differs, too, nothing can be concluded.

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
        if recording.commands_sha256 is None:
            return NOT_CHECKED, "it was recorded before commands were hashed"
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
            backend=_backend(bundle.submission, (bundle.result.parent,), limits),
        )
        phase.run(lambda progress: None).close()
        with Recording(phase.out) as again:
            if not (difference := _play_difference(recording, again)):
                return HOLDS, "it plays the same and hands over the same state"
            phase = replace(phase, out=folder / "once-more.h5")
            phase.run(lambda progress: None).close()
            with Recording(phase.out) as once_more:
                if _play_difference(again, once_more):
                    return NOT_CHECKED, "it does not play the same twice"
        return _differs(header.versions, difference)


def _play_difference(recording: Recording, again: Recording) -> str:
    """How a play differs from what was recorded; empty if it does not."""
    if again.commands_sha256 != recording.commands_sha256:
        return "it plays differently: this play is not its own"
    if not is_same_state(recording.controller_state(), again.controller_state()):
        return "it plays the same, but hands over another state"
    return ""


def _differs(versions: Mapping[str, str], how: str, verdict: str = FAILS) -> PartOutcome:
    """A verdict on what differs from the recorded, which is not decided under other physics."""
    physics = Physics.of(versions)
    if not physics.differs:
        return verdict, how
    return UNDECIDED, f"{how}; its physics is {physics.then}, which may be why"


def _backend(submission: Path, secrets: tuple[Path, ...], limits: Limits) -> SandboxBackend:
    """Where a submission is run again.

    Raises:
        RealBenchError: what it requires cannot be had here; it was once, so it is not to blame.
    """
    required = read_submission(submission)
    try:
        packages_of(required)
    except SubmissionError as error:
        raise RealBenchError(str(error)) from error
    return SandboxBackend(secrets, limits)


class _Tests:
    """Repeatable tests on goals of a result."""

    def __init__(
        self,
        result: Result,
        bundle: Bundle,
        goals: Path | None,
        scene: str | None,
        limits: Limits,
    ) -> None:
        assert bundle.submission is not None
        self._setting, self._bundle = result.setting, bundle
        self._goals = _goal_set(result, goals)
        self._scene = load_scene(scene or self._setting.scene)
        self._controller = str(bundle.submission)
        files = (bundle.result, *([bundle.recording] if bundle.recording else []))
        secrets = (*files, *([goals] if goals else []))
        self._backend = _backend(bundle.submission, secrets, limits)

    @property
    def identity(self) -> Identity:
        """What the submission is."""
        return self._backend.identity(self._controller, self._setting.settings)

    def commands(self, numbers: Sequence[int], wanted: Wanted | None) -> list[str]:
        """The hashes of what it commands for each of these goals."""
        return list(self._run_trials(numbers, wanted))

    def _run_trials(self, numbers: Sequence[int], wanted: Wanted | None) -> Iterator[str]:
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
            for number in numbers:
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
