"""The API for notebooks: the two phases, experiments, scores, comparisons, figures.

Each function does what the command of its name does, and returns the outcome. Paths may be text.
What is left out comes from the recording or the goals, or is the command's default. Ctrl-C raises
:class:`~real_bench.errors.Interrupted`, a ``KeyboardInterrupt``; what was done is kept.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from real_bench.errors import ControllerError, RealBenchError, ResultError
from real_bench.wording import speaks_python

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from real_bench.environment import RealEnv
    from real_bench.experiments.scores import Row
    from real_bench.goal_sets import GoalSet
    from real_bench.phases.handover import Wanted
    from real_bench.recording import Recording
    from real_bench.scoring.comparison import Comparison
    from real_bench.scoring.result import Result
    from real_bench.scoring.verdict import Verdict

    Results = Result | str | Path | Iterable[Result | str | Path]

PathLike = str | Path


@speaks_python
def make_env(
    condition: str = "OM",
    *,
    objects: int = 1,
    scene: PathLike = "official",
    goals: GoalSet | PathLike | None = None,
    max_steps: int | None = None,
    render_mode: str | None = None,
) -> RealEnv:
    """The benchmark as a Gymnasium environment; see :class:`real_bench.environment.RealEnv`."""
    from real_bench.environment import RealEnv

    return RealEnv(
        condition,
        objects=objects,
        scene=scene,
        goals=goals,
        max_steps=max_steps,
        render_mode=render_mode,
    )


@speaks_python
def run_intrinsic(
    controller: PathLike | None = None,
    *,
    out: PathLike = "run.h5",
    condition: str | None = None,
    objects: int | None = None,
    scene: PathLike | None = None,
    steps: int | None = None,
    seed: int | None = None,
    images: bool | None = None,
    settings: Mapping[str, Any] | None = None,
    isolate: bool = False,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = True,
) -> Recording:
    """Let a controller play, as ``realbench intrinsic`` does (paper, section Scenario).

    Args:
        controller: name, ``module:Class`` or file; may be left out to resume a run.
        out: the recording, HDF5.
        condition: two letters, IM by default.
        objects: how many, 1 by default.
        scene: ``official`` (the default), ``builtin``, or a manifest.
        steps: simulation steps of 5 ms; 15,000,000 by default.
        seed: of the controller's randomness, 0 by default.
        images: whether to record them; by default if the condition or the controller needs them.
        settings: values for the controller's settings.
        isolate: run the controller in a process of its own that cannot reach anything else.
        resume: continue the recording if it exists.
        overwrite: replace the recording if it exists.
        progress: show it on standard error, whereto what the controller prints goes then, too.

    Returns:
        The recording, open; close it, or use it as a context manager.

    Raises:
        RealBenchError: something is wrong, before or while it runs; what was recorded is kept.
        Interrupted: by Ctrl-C; ``resume`` continues.
    """
    from real_bench.phases.plans import plan_play
    from real_bench.recording import Recording

    out = _as_path(out, "out")
    phase = plan_play(
        out,
        resume=resume,
        settings=settings,
        backend=_backend(isolate, [out]),
        controller=_named(controller),
        condition=condition,
        objects=objects,
        scene=None if scene is None else _as_path(scene, "scene"),
        steps=steps,
        seed=seed,
        images=images,
    )
    if progress:
        from real_bench.progress.phases import play

        play(phase, resume=resume, overwrite=overwrite).close()
    else:
        phase.run(_ignore, resume=resume, overwrite=overwrite).close()
    return Recording(out)


@speaks_python
def run_extrinsic(
    controller: PathLike | None = None,
    *,
    run: PathLike | Recording | None = None,
    run_steps: int | None = None,
    goals: GoalSet | PathLike | None = None,
    condition: str | None = None,
    objects: int | None = None,
    scene: PathLike | None = None,
    seed: int | None = None,
    settings: Mapping[str, Any] | None = None,
    trials: int | None = None,
    trial_steps: int | None = None,
    jobs: int = 1,
    out: PathLike = "score.json",
    isolate: bool = False,
    learned: Wanted | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = True,
) -> Result:
    """Test a controller on goals, as ``realbench extrinsic`` does (paper, section Metrics).

    Args:
        controller: name, ``module:Class`` or file; the recording's by default.
        run: the recording to learn from, or its file.
        run_steps: learn only from its first steps.
        goals: a goal set or its file; the shipped one by default.
        condition: two letters; the recording's by default.
        objects: how many; the recording's by default.
        scene: its name or manifest; the recording's by default.
        seed: of the test; the recording's by default.
        settings: values for the controller's settings; they override the recording's.
        trials: test only this many goals, each class in proportion.
        trial_steps: length of a trial, 10,000 steps by default.
        jobs: number of processes; the scores do not depend on it.
        out: the result file, JSON.
        isolate: run the controller in a process of its own that cannot reach anything else.
        learned: if code or settings have changed since the play: ``keep`` what it learned, learn
            ``again``, or test it as made, with ``nothing``.
        resume: continue the result file if it exists.
        overwrite: replace the result file if it exists.
        progress: show it on standard error, whereto what the controller prints goes then, too.

    Raises:
        RealBenchError: something is wrong, before or while it runs; finished trials are kept.
        Interrupted: by Ctrl-C; ``resume`` continues.
    """
    from real_bench.files import defaults
    from real_bench.lengths import TRIAL_STEPS
    from real_bench.phases.extrinsic import ExtrinsicPhase
    from real_bench.phases.plans import plan_test

    path = None if run is None else _as_path(run, "run")
    result = _as_path(out, "out")
    goals_file = Path(goals) if isinstance(goals, str | os.PathLike) else None
    plan = plan_test(
        controller=_named(controller),
        run=path,
        run_steps=run_steps,
        goals=goals,
        condition=condition,
        objects=objects,
        scene=None if scene is None else str(_as_path(scene, "scene")),
        seed=seed,
        settings=settings,
        backend=_backend(isolate, [result, path, defaults.existing_run(), goals_file]),
        trial_steps=TRIAL_STEPS if trial_steps is None else trial_steps,
        wanted=learned,
    )
    n_trials = len(plan.goal_set) if trials is None else trials
    phase = ExtrinsicPhase(plan, n_trials, result, jobs)
    if progress:
        from real_bench.progress.phases import run_trials

        return run_trials(phase, resume=resume, overwrite=overwrite)
    return phase.run(_ignore, resume=resume, overwrite=overwrite)


@speaks_python
def run_experiment(
    spec: PathLike, *, jobs: int | None = None, make: bool = True, progress: bool = True
) -> list[Row]:
    """Run an experiment as ``realbench table`` does; returns the rows of its table.

    Args:
        spec: the experiment's YAML file.
        jobs: how many plays and tests at once; by default one per core.
        make: run what is missing; otherwise only existing results count.
        progress: show it on standard error.

    Raises:
        ExperimentError: it is invalid, or a play or test failed.
        Interrupted: by Ctrl-C; finished plays and tests are kept.
    """
    from functools import partial

    from real_bench.errors import ExperimentError, in_short
    from real_bench.experiments import read_spec
    from real_bench.experiments.running import Experiment
    from real_bench.progress.jobs import run_jobs

    experiment = Experiment(read_spec(_as_path(spec, "spec")), jobs)
    if make:
        with experiment.lock_folder():
            experiment.prepare()
            work, failures = experiment.missing(), {}
            if len(work):
                experiment.check(work)
                run = partial(experiment.make, work)
                failures = run_jobs(work, run) if progress else run(_ignore)
        if failures:
            raise ExperimentError(in_short([failure.detail for failure in failures.values()]))
    return experiment.rows()


@speaks_python
def load_goals(path: PathLike) -> GoalSet:
    """Read a goal set; raises GoalSetError if it is not one."""
    from real_bench.goal_sets import load_goal_set

    return load_goal_set(_as_path(path, "path"))


@speaks_python
def load_result(path: PathLike) -> Result:
    """Read a result; raises ResultError if it is not one, or was altered."""
    from real_bench.scoring.result import load_result

    return load_result(_as_path(path, "path"))


@speaks_python
def score(
    results: Results,
    *,
    minimum: float | None = None,
    baseline: Results | None = None,
    allow_part: bool = False,
) -> Verdict:
    """Judge results as ``realbench score`` does: complete, of full length, good enough?

    Args:
        results: of one controller, or their files, a folder of them, or a pattern; results on the
            same goal set are repeats.
        minimum: the lowest mean score that passes.
        baseline: results on the same goals; the others must not be worse beyond chance.
        allow_part: also pass a finished test of only a part of the goals.

    Raises:
        ResultError: there is no result, or a file is none.
    """
    from real_bench.goal_sets import shipped_sizes
    from real_bench.scoring import verdict

    mine = _as_list(results)
    setting = mine[0].setting
    return verdict.judge(
        mine,
        minimum,
        None if baseline is None else _as_list(baseline),
        goals=None,
        sizes=shipped_sizes(setting.objects, setting.scene),
        allow_part=allow_part,
    )


@speaks_python
def compare(a: Results, b: Results) -> Comparison:
    """Compare two sets of results goal by goal, as ``realbench compare`` does.

    Args:
        a: results or their files, a folder of them, or a pattern.
        b: the same, of the others.

    Raises:
        ResultError: scene, number of objects, length or goals differ, or a file is no result.
    """
    from real_bench.scoring.comparison import compare

    return compare(_as_list(a), _as_list(b))


@speaks_python
def draw_figures(
    recordings: PathLike | Recording | Iterable[PathLike | Recording] = (),
    results: PathLike | Iterable[PathLike] = (),
    *,
    settings: Mapping[str, Any] | None = None,
    run_steps: int | None = None,
    seed: int = 0,
) -> dict[str, Figure]:
    """The paper's figures for which files have the data, by name, as ``realbench figures``.

    Args:
        recordings: files of intrinsic phases, or open recordings.
        results: files of extrinsic phases on the same goals.
        settings: for how REAL-LD sees and abstracts, in recordings that do not keep weights.
        run_steps: how many of each recording's first steps count; None: all.
        seed: of learning to see, and of the pairs whose distances are compared.

    Raises:
        RealBenchError: a file is not what it should be, or there is nothing to draw.
    """
    from real_bench.figures import FigureOptions, draw_all, read_figure_data

    played = [_as_path(each, "a recording") for each in _as_sequence(recordings)]
    tested = [_as_path(each, "a result") for each in _as_sequence(results)]
    options = FigureOptions(settings or {}, seed, run_steps)
    drawn = draw_all(read_figure_data(played, tested, options))
    return {name: drawing.figure for name, drawing in drawn.items()}


def _named(controller: object) -> str | None:
    if controller is None or isinstance(controller, str | Path):
        return None if controller is None else str(controller)
    from real_bench.inputs.numeric import short

    raise ControllerError(
        f"a controller is told by its name, module:Class or file, not {short(controller)}: write "
        "a class into a file, since its code is kept with what it did"
    )


def _backend(isolate: bool, secrets: Sequence[Path | None]) -> Any:
    if not isolate:
        from real_bench.phases.local import LocalBackend

        return LocalBackend()
    from real_bench.sandbox import SandboxBackend

    return SandboxBackend(tuple(path for path in secrets if path is not None))


def _as_path(given: object, what: str) -> Path:
    """The path that was given, or that of a recording."""
    if isinstance(given, str | os.PathLike):
        return Path(given)
    from real_bench.inputs.numeric import short
    from real_bench.recording import Recording

    if isinstance(given, Recording):
        return given.path
    raise RealBenchError(f"{what} must be a path, not {short(given)}")


def _as_list(results: Results) -> list[Result]:
    several = _as_sequence(results)
    if not several:
        raise ResultError("no results were given")
    return [result for each in several for result in _as_results(each)]


def _as_results(given: object) -> list[Result]:
    from real_bench.inputs.numeric import short
    from real_bench.scoring.named import read_results
    from real_bench.scoring.result import Result

    if isinstance(given, Result):
        return [given]
    if not isinstance(given, str | os.PathLike):
        raise ResultError(f"a result must be a Result or its file, not {short(given)}")
    return read_results(os.fspath(given))


def _as_sequence(values: Any) -> Sequence[Any]:
    several = isinstance(values, Iterator | Collection)  # a Recording or Result is neither
    return list(values) if several and not isinstance(values, str) else [values]


def _ignore(progress: object) -> None:
    """Do nothing."""
