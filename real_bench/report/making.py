"""Make a report from files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from real_bench.errors import GoalSetError, RealBenchError, ResultError, SceneError
from real_bench.experiments import read_spec
from real_bench.experiments.running import Experiment
from real_bench.experiments.table import columns, notes
from real_bench.figures import FIGURES, FigureOptions, read_figure_data
from real_bench.goal_sets import GoalSet, load_goal_set, shipped_goal_set
from real_bench.report.page import Chart, Report, Table
from real_bench.report.parts import ResultEntry, read_played, read_tested
from real_bench.report.pictures import data_uri
from real_bench.scoring.result import Setting, load_result
from real_bench.simulation import load_scene
from real_bench.simulation.scene import shipped_scenes

Progress = Callable[[int, str], None]
"""Called with the number of results read, and the name of the next."""


@dataclass(frozen=True)
class ReportFiles:
    """The files of a report.

    Attributes:
        experiments: shown as tables.
        recordings, results: shown, and drawn as figures.
        goals: goal sets of the results, for pictures; the shipped ones are known.
        videos: folder with films of the trials, if there is one result.
        released: whether secret goals may be shown.
        scene: name or manifest of the results' scene; a shipped one, or a recording's, is found.
    """

    experiments: Sequence[Path] = ()
    recordings: Sequence[Path] = ()
    results: Sequence[Path] = ()
    goals: Sequence[Path] = ()
    videos: Path | None = None
    released: bool = False
    scene: str | None = None

    def __post_init__(self) -> None:
        if self.videos is not None and len(self.results) != 1:
            raise RealBenchError(f"--videos needs exactly one result, not {len(self.results)}")


def make_report(
    files: ReportFiles, title: str, progress: Progress = lambda done, name: None
) -> Report:
    """Read all files, draw what can be drawn, and remark on the rest; raises RealBenchError."""
    tables = [_table(path) for path in files.experiments]
    plays = [read_played(path) for path in files.recordings]
    results = {path: load_result(path) for path in files.results}
    sets = _goal_sets(files.goals, [result.setting for result in results.values()])
    for file, goal_set in sets:
        if goal_set.is_secret and not files.released:
            raise GoalSetError(
                f"the goals in {file} are secret, and a report would show them: use --released "
                "once they may be seen"
            )
    scenes = [] if files.scene is None else [load_scene(files.scene).source]
    tests: list[ResultEntry] = []
    begun = [path for path, result in results.items() if result.trials]
    for path in begun:
        progress(len(tests), path.name)
        tests.append(read_tested(path, plays, sets, files.videos, scenes))
    charts, remarks = _charts(files.recordings, begun)
    remarks += [f"{path.name}: has no trial yet" for path in results if path not in begun]
    return Report(title, tables, plays, tests, charts, [*remarks, *_missing_pictures(tests)])


def _table(path: Path) -> Table:
    experiment = Experiment(read_spec(path))
    rows = experiment.rows()
    headings, shown = columns(rows)
    return Table(
        title=experiment.spec.title,
        headings=tuple(headings),
        rows=tuple(map(tuple, shown)),
        notes=tuple(notes(experiment.spec, rows)),
        command=f"realbench table {path.name}",
    )


def _goal_sets(
    files: Sequence[Path], settings: Sequence[Setting]
) -> list[tuple[str | None, GoalSet]]:
    """The goal sets that results may be on, and how the command line names them."""
    found: list[tuple[str | None, GoalSet]] = [(file.name, load_goal_set(file)) for file in files]
    for objects, scene in sorted({(setting.objects, setting.scene) for setting in settings}):
        try:
            found.append((None, load_goal_set(shipped_goal_set(objects, scene))))
        except GoalSetError:
            continue
    return found


def _charts(recordings: Sequence[Path], results: Sequence[Path]) -> tuple[list[Chart], list[str]]:
    """The figures that can be drawn, and remarks on those that cannot."""
    remarks: list[str] = []
    try:
        material = read_figure_data(recordings, results, FigureOptions())
    except ResultError as error:
        remarks.append(f"no figures of scores: {error}")
        material = read_figure_data(recordings, [], FigureOptions())
    charts = [
        Chart(
            name=kind.name,
            shows=kind.shows,
            width_cm=drawing.width_cm,
            svg=data_uri(drawing.svg(), "image/svg+xml"),
            csv=data_uri(drawing.numbers.csv(), "text/csv"),
        )
        for kind in FIGURES
        if (drawing := kind.draw(material)) is not None
    ]
    return charts, remarks


def _missing_pictures(tests: Sequence[ResultEntry]) -> list[str]:
    """Which pictures are missing, and how to get them."""
    remarks = []
    for test in tests:
        if test.trials[0].goal is None:
            remarks.append(f"{test.file}: no pictures of its goals; give its goal set with --goals")
        if test.trials[0].end is None:
            remarks.append(f"{test.file}: no pictures of its ends; {_scene_fault(test)}")
    return remarks


def _scene_fault(test: ResultEntry) -> str:
    """Why nothing can be drawn in the scene of a result."""
    scene = test.result.setting.scene
    try:
        load_scene(scene)
    except SceneError as error:
        if scene in shipped_scenes():  # not installed, with the remedy
            return str(error)
    return f"its scene {scene} was not found as it was then: give the manifest with --scene"
