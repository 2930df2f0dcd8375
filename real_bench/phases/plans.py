"""Phases from what a user gives; the rest comes from the recording, the goals or defaults."""

from __future__ import annotations

import logging
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from real_bench.conditions import Condition
from real_bench.controller_code.source import ControllerSource, resolved
from real_bench.errors import ControllerError, RealBenchError, RecordingError
from real_bench.files import defaults
from real_bench.files.locks import is_being_written
from real_bench.goal_sets import GoalSet, as_goal_set, load_goal_set, shipped_goal_set
from real_bench.inputs.numeric import short
from real_bench.lengths import INTRINSIC_STEPS, TRIAL_STEPS
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.local import LocalBackend
from real_bench.phases.proxy import ControllerBackend
from real_bench.phases.trial import TrialPlan
from real_bench.recording import Header, Recording
from real_bench.settings import Values, merged
from real_bench.simulation import DEFAULT_SCENE, Scene, load_scene
from real_bench.text.quoting import quoted

DEFAULT_CONDITION = "IM"

NEW_RUN: dict[str, Any] = {
    "controller": None,
    "condition": DEFAULT_CONDITION,
    "objects": 1,
    "scene": DEFAULT_SCENE,
    "steps": INTRINSIC_STEPS,
    "seed": 0,
    "images": None,
    "settings": {},
}

log = logging.getLogger(__name__)


def plan_play(
    out: Path,
    *,
    resume: bool = False,
    settings: Mapping[str, Any] | None = None,
    backend: ControllerBackend | None = None,
    **given: Any,
) -> IntrinsicPhase:
    """An intrinsic phase; what is None or left out comes from the recording or the defaults.

    Args:
        out: the recording.
        resume: take what is left out from the recording, if it exists.
        settings: values for the controller's settings, above those of the recording.
        backend: where the controller runs; our own process unless told otherwise.
        **given: ``controller``, ``condition``, ``objects``, ``scene``, ``steps``, ``seed``,
            ``images``.

    Raises:
        RealBenchError: there is no controller, or something does not exist.
    """
    backend = backend or LocalBackend()
    known = NEW_RUN
    if resume and out.exists():
        known = _recorded_options(out, given.get("controller"), backend)
    chosen = {**known, **{key: value for key, value in given.items() if value is not None}}
    if chosen["controller"] is None and resume:
        raise RecordingError(
            f"{out} does not exist: there is nothing to resume (to begin, give a controller)"
        )
    if chosen["controller"] is None:
        raise RealBenchError("no controller given (try --controller real_r)")
    if known is NEW_RUN and given.get("condition") is None:
        chosen["condition"] = _condition_of(chosen["controller"])
    chosen["settings"] = merged(known["settings"], _values(settings))
    chosen["condition"] = Condition.parse(chosen["condition"])
    chosen["scene"] = load_scene(chosen["scene"])
    return IntrinsicPhase(out=out, backend=backend, **chosen)


def plan_test(
    *,
    controller: str | None = None,
    run: Path | None = None,
    run_steps: int | None = None,
    goals: GoalSet | str | Path | None = None,
    condition: str | None = None,
    objects: int | None = None,
    scene: str | None = None,
    seed: int | None = None,
    settings: Mapping[str, Any] | None = None,
    backend: ControllerBackend | None = None,
    trial_steps: int = TRIAL_STEPS,
    **options: Any,
) -> TrialPlan:
    """Trials; what is left out comes from the recording or the goals.

    Args:
        controller: name, ``module:Class`` or file; the recording's by default.
        run: the recording to learn from; by default ``run.h5``, if it exists and fits.
        run_steps: learn only from its first steps.
        goals: a goal set or its file; the shipped one by default.
        condition: two letters; the recording's, or IM.
        objects: how many; the recording's, or as the goals have.
        scene: its name or manifest; the recording's, or ``official``.
        seed: of the test; the recording's, or 0.
        settings: values for the controller's settings, above those of the recording.
        backend: where the controller runs; our own process unless told otherwise.
        trial_steps: length of a trial.
        **options: ``videos``, ``pictures``, ``explanations``, ``wanted`` of a
            :class:`~real_bench.phases.trial.TrialPlan`.

    Raises:
        RealBenchError: there is no controller, the recording does not fit, or something does not
            exist.
    """
    backend = backend or LocalBackend()
    path, header = _find_run(run, optional=controller is not None)
    given = None if goals is None else as_goal_set(goals)
    if header and run is None and (reasons := _misfits(header, given, condition, objects, scene)):
        log.info("%s is not used: %s", path, "; ".join(reasons))
        path = header = None
    if controller is None and header is None:
        raise RealBenchError(
            "no controller given, and no recording to take it from (try --controller real_r)"
        )
    if objects is None:
        objects = header.objects if header else given.n_objects if given else 1
    if condition is None:
        condition = header.condition if header else _condition_of(controller)
    if scene is None:
        scene = header.scene_source if header else DEFAULT_SCENE
    loaded = load_scene(scene)
    n_objects = len(loaded.object_names(objects))
    if path is not None:
        _check_is_over(path, run_steps)
    return TrialPlan(
        controller=controller or (header.controller_source if header else ""),
        condition=Condition.parse(condition),
        scene=loaded,
        goal_set=goals_for_test(given, n_objects, loaded),
        seed=seed if seed is not None else (header.seed if header else 0),
        trial_steps=trial_steps,
        run=path,
        run_steps=run_steps,
        settings=merged(recorded_settings(header, controller, backend), _values(settings)),
        backend=backend,
        **options,
    )


def plan_test_after(
    phase: IntrinsicPhase, goals: GoalSet | str | Path | None, trial_steps: int
) -> TrialPlan:
    """Trials of the controller that has just played, in the same process."""
    given = None if goals is None else as_goal_set(goals)
    return TrialPlan(
        controller=phase.controller,
        condition=phase.condition,
        scene=phase.scene,
        goal_set=goals_for_test(given, phase.objects, phase.scene),
        seed=phase.seed,
        trial_steps=trial_steps,
        run=phase.out,
        settings=phase.settings,
        backend=phase.backend,
    )


def _values(settings: Mapping[str, Any] | None) -> Mapping[str, Any]:
    if settings is not None and not isinstance(settings, Mapping):
        raise ControllerError(
            f'settings must be a dict, e.g. {{"planner": {{"depth": 8}}}}, not {short(settings)}'
        )
    return settings or {}


def _misfits(
    header: Header,
    goals: GoalSet | None,
    condition: str | None,
    objects: int | None,
    scene: str | None,
) -> list[str]:
    """Why a recording that nobody named cannot serve a test of which this is given."""
    if objects is None:
        objects = header.objects if goals is None else goals.n_objects
    return header.mismatches(
        Condition.parse(condition or header.condition),
        objects,
        header.scene_sha256 if scene is None else load_scene(scene).sha256,
    )


def _condition_of(controller: str | None) -> str:
    """The condition that a submission is made for, or the default one."""
    submission = None if controller is None else ControllerSource.of(controller).submission
    return DEFAULT_CONDITION if submission is None else submission.condition


def goals_for_test(given: GoalSet | None, n_objects: int, scene: Scene) -> GoalSet:
    """The given goals, or the shipped ones; raises GoalSetError if they do not fit."""
    goal_set = given or load_goal_set(shipped_goal_set(n_objects, scene.name))
    goal_set.check_fits(scene, n_objects)
    return goal_set


def recorded_settings(
    header: Header | None, controller: str | None, backend: ControllerBackend
) -> Values:
    """The settings that a run was played with, if its controller is the wanted one."""
    if header is None or controller is None:
        return header.settings if header else {}
    one = backend.identity(controller, None)
    if header.was_made_by(resolved(controller), one.code_sha256, one.class_name):
        return header.settings
    if header.settings and header.controller_class == one.class_name:
        log.warning(
            "the play was by %s, whose code is different: its settings are not used (give them "
            "by --set or --settings)",
            quoted(header.controller_source),
        )
    return {}


def _recorded_options(
    path: Path, controller: str | None, backend: ControllerBackend
) -> dict[str, Any]:
    """What a recording was made with; settings only for its own controller."""
    with Recording(path) as recording:
        header = recording.header
        return {
            "controller": header.controller_source,
            "condition": header.condition,
            "objects": header.objects,
            "scene": header.scene_source,
            "steps": recording.total_steps,
            "seed": header.seed,
            "images": header.images or None,  # where none were wanted, as it was then
            "settings": recorded_settings(header, controller, backend),
        }


def resume_command(run: Path) -> str:
    """The command that continues a play."""
    return f"realbench intrinsic --out {shlex.quote(str(run))} --resume"


def _find_run(run: Path | None, *, optional: bool) -> tuple[Path | None, Header | None]:
    """The given recording, or the default one if it exists."""
    path = run or defaults.RUN
    if run is None and not path.exists():
        return None, None
    try:
        with Recording(path) as recording:
            return path, recording.header
    except RecordingError as error:
        if run is not None or not optional:
            raise
        log.info("%s is not used: %s", path, error)
        return None, None


def _check_is_over(run: Path, run_steps: int | None) -> None:
    """Refuse a play that goes on, whose recording would be another one in a moment."""
    if is_being_written(run):
        raise RecordingError(
            f"{run} is being played: test it when the play is over, or stop the play and go on "
            f"afterwards ({resume_command(run)})"
        )
    with Recording(run) as recording:
        n_steps, total, ended = recording.n_steps, recording.total_steps, recording.ended
    if run_steps is not None:
        return
    if n_steps < total:
        log.warning("%s ends after %s of %s steps", run, f"{n_steps:,}", f"{total:,}")
    elif not ended:
        log.warning(
            "%s has all %s steps, but what the controller does at their end (end_intrinsic_phase, "
            "use_experience) failed or was stopped: `%s` does it again",
            run,
            f"{n_steps:,}",
            resume_command(run),
        )
