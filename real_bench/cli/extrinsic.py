"""``realbench extrinsic``."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from real_bench.cli import options
from real_bench.cli.printing import print_tables, say
from real_bench.errors import RecordingError

if TYPE_CHECKING:
    from real_bench.goal_sets import GoalSet
    from real_bench.phases.extrinsic import ExtrinsicPhase
    from real_bench.phases.guest import Guest, Host
    from real_bench.phases.handover import Wanted
    from real_bench.phases.trial import TrialPlan
    from real_bench.recording import Header
    from real_bench.scoring.result import Result
    from real_bench.simulation import Scene

EPILOG = """\b
Example:
  realbench extrinsic --run run.h5 --goals goals.npy --out score.json --jobs 2
  realbench extrinsic --controller real_d --set planner.depth=8 --explain why
  realbench extrinsic --controller real_r --condition OM --trials 5
  realbench extrinsic --run run.h5 --min-score 0.2    # exit code 3 below 0.2, for CI
"""

BELOW_MINIMUM = 3


@click.command(epilog=EPILOG)
@options.setting_options
@options.testing_options
@click.option("--video", type=options.FILE, metavar="DIR", help="Film each trial (.mp4) there.")
@click.option(
    "--pictures", type=options.FILE, metavar="DIR", help="Start, goal and end of each trial (.png)."
)
@click.option(
    "--explain",
    type=options.FILE,
    metavar="DIR",
    help="Why each action was chosen, for each trial: a record (.json) and a picture (.png).",
)
@options.min_score_option
@options.allow_part_option
@options.resume_option
@options.overwrite_option
@options.json_option
@options.isolation_options()
def extrinsic(
    out: Path, min_score: float | None, allow_part: bool, as_json: bool, **given: Any
) -> None:
    """Test a controller on goals that it has never seen, and print the score table.

    Controller, its settings, condition, objects and scene are by default those of the recording.
    Every trial lasts 10,000 steps and begins in a fresh world.
    """
    result = result_of(out=out, allow_part=allow_part or min_score is None, **given)
    show(result, out, as_json=as_json)
    judge(result, min_score)


def result_of(
    *,
    trials: int | None,
    allow_part: bool,
    jobs: int,
    out: Path,
    isolation: options.Isolation,
    resume: bool,
    overwrite: bool,
    secrets: Iterable[Path | None] = (),
    **given: Any,
) -> Result:
    """The result of the test that the options ask for; progress is shown.

    An isolated controller must not be able to read any file of the test, nor ``secrets``.
    """
    from real_bench.phases.extrinsic import ExtrinsicPhase

    files = [given.get(name) for name in ("run", "goals", "video", "pictures", "explain")]
    default = [options.DEFAULT_RUN] if options.DEFAULT_RUN.exists() else []
    plan = plan_trials(**given, host=isolation.host([out, *default, *files, *secrets]))
    phase = ExtrinsicPhase(plan, trials_asked(trials, plan, allow_part=allow_part), out, jobs)
    return run_trials(phase, resume=resume, overwrite=overwrite)


def plan_trials(
    *,
    controller: str | None,
    settings_file: Path | None,
    assignments: tuple[str, ...],
    run: Path | None,
    run_steps: int | None,
    learned: Wanted | None,
    trial_steps: int,
    goals: Path | None,
    condition: str | None,
    objects: int | None,
    scene: str | None,
    seed: int | None,
    video: Path | None = None,
    pictures: Path | None = None,
    explain: Path | None = None,
    host: Host | None = None,
) -> TrialPlan:
    """What the options describe; what they leave out comes from the recording or the goals."""
    from real_bench.conditions import Condition
    from real_bench.goal_sets import load_goal_set
    from real_bench.phases.local import LocalHost
    from real_bench.phases.trial import TrialPlan
    from real_bench.settings import merged, read_settings
    from real_bench.simulation import DEFAULT_SCENE, load_scene

    host = host or LocalHost()
    path, header = _find_run(run, optional=controller is not None)
    given = load_goal_set(goals) if goals else None
    known = header.objects if header else given.n_objects if given else 1
    n_objects = known if objects is None else objects
    scene = (header.scene_source if header else DEFAULT_SCENE) if scene is None else scene
    condition = (header.condition if header else "IM") if condition is None else condition
    loaded = load_scene(scene)
    loaded.object_names(n_objects)
    wanted = Condition.parse(condition)
    if header and (misfits := header.misfits(wanted, n_objects, loaded.sha256)):
        if run is not None:
            raise RecordingError(f"{run} does not fit this test: {'; '.join(misfits)}")
        say(f"{path} is not used: {'; '.join(misfits)}", err=True)
        path = header = None
    if controller is None and header is None:
        raise click.UsageError(
            "--controller is missing, and there is no recording to take it from "
            "(try --controller real_r)"
        )
    return TrialPlan(
        controller=controller or (header.controller_source if header else ""),
        condition=wanted,
        scene=loaded,
        goal_set=goals_for_test(given, n_objects, loaded),
        seed=seed if seed is not None else (header.seed if header else 0),
        trial_steps=trial_steps,
        run=path,
        run_steps=run_steps,
        settings=merged(
            options.recorded_settings(header, controller, host),
            read_settings(settings_file, assignments),
        ),
        videos=video,
        pictures=pictures,
        explanations=explain,
        wanted=learned,
        host=host,
    )


def trials_asked(trials: int | None, plan: TrialPlan, *, allow_part: bool) -> int:
    """How many goals are to be tested: all of them unless told otherwise.

    Raises UsageError for a part of them that is to be judged, unless that is allowed.
    """
    whole = len(plan.goal_set)
    if trials is not None and 0 < trials < whole and not allow_part:
        raise click.UsageError(
            f"--trials {trials} tests a part of the {whole} goals: to have it judged all the same, "
            "use --allow-part"
        )
    return whole if trials is None else trials


def goals_for_test(given: GoalSet | None, n_objects: int, scene: Scene) -> GoalSet:
    """The goals that are given, or the shipped ones; raises GoalSetError if they do not fit."""
    from real_bench.goal_sets import load_goal_set, shipped_goal_set

    goal_set = given or load_goal_set(shipped_goal_set(n_objects))
    goal_set.check_fits(scene, n_objects)
    return goal_set


def run_trials(
    phase: ExtrinsicPhase, *, resume: bool, overwrite: bool, guest: Guest | None = None
) -> Result:
    """Run the phase with progress shown."""
    from real_bench.cli.progress import ProgressDisplay

    title = f"testing {phase.plan.controller}"
    with ProgressDisplay(title, "goals", phase.n_trials) as display:

        def report(result: Result) -> None:
            display.update(len(result.trials), f"score {result.score:.3f}")

        with contextlib.redirect_stdout(sys.stderr):  # what a controller prints is no result
            return phase.run(report, resume=resume, overwrite=overwrite, guest=guest)


def show(result: Result, out: Path, *, as_json: bool) -> None:
    """Print the score table, or as JSON what the file holds and what follows from it."""
    from real_bench.scoring.summary import summary_json

    if as_json:
        say(json.dumps({**result.to_json(), "summary": summary_json(result)}))
        return
    from real_bench.scoring.table import score_table

    print_tables(score_table(result))
    say(f"result: {out}")


def judge(result: Result, min_score: float | None) -> None:
    """Exit with 3 where the score is below a minimum."""
    if min_score is not None and result.score < min_score:
        say(f"realbench: score {result.score:.4f} is below {min_score}", err=True)
        sys.exit(BELOW_MINIMUM)


def _find_run(run: Path | None, *, optional: bool) -> tuple[Path | None, Header | None]:
    """The recording that is asked for, or the default one where there is one."""
    from real_bench.recording import Recording

    path = run or options.DEFAULT_RUN
    if run is None and not path.exists():
        return None, None
    try:
        with Recording(path) as recording:
            return path, recording.header
    except RecordingError as error:
        if run is not None or not optional:
            raise
        say(f"{path} is not used: {error}", err=True)
        return None, None
