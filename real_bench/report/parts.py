"""What a report tells of recordings and results."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from real_bench.errors import ResultError, SceneError
from real_bench.files.hashing import file_sha256
from real_bench.goal_sets import GoalSet
from real_bench.goal_sets.picture import bounding_box_of_bodies
from real_bench.recording import Header, Recording
from real_bench.report.commands import play_command, scoring_command
from real_bench.report.pictures import films, picture, render_ends
from real_bench.scoring.metric import METRICS
from real_bench.scoring.result import Result, Setting, TrialResult, load_result
from real_bench.scoring.table import score_columns
from real_bench.simulation import Image, load_scene


@dataclass(frozen=True)
class RecordingEntry:
    """A recording.

    Attributes:
        file, sha256: its name, and hash.
        header: what it takes to redo it.
        command: what does.
        steps, actions: how long it is.
        share_moved: of the actions, moved an object by more than 1 cm; NaN without actions.
        cuts: at which steps it was interrupted, and continued in a fresh world.
        learned_by: the controller whose learning it keeps; None if it keeps none.
    """

    file: str
    sha256: str
    header: Header
    command: str
    steps: int
    actions: int
    share_moved: float
    cuts: tuple[int, ...]
    learned_by: str | None


@dataclass(frozen=True)
class Trial:
    """A trial, with pictures and film as data URIs; None if there is none."""

    result: TrialResult
    start: str | None
    goal: str | None
    end: str | None
    film: str | None

    @property
    def metrics(self) -> dict[str, str]:
        """Every metric as it is printed, by its title."""
        return {metric.title: metric.text_of(self.result) for metric in METRICS.values()}


@dataclass(frozen=True)
class ResultEntry:
    """A result.

    Attributes:
        file: its name.
        result: itself.
        command: reproduces it.
        headings, rows: of its score table, the total last.
        trials: in the order of goals.
    """

    file: str
    result: Result
    command: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    trials: tuple[Trial, ...]


def read_played(path: Path) -> RecordingEntry:
    """Read a recording; raises RecordingError."""
    with Recording(path) as recording:
        learned = recording.controller_state() or recording.controller_files()
        return RecordingEntry(
            file=path.name,
            sha256=file_sha256(path),
            header=recording.header,
            command=play_command(recording.header, recording.total_steps, path.name),
            steps=recording.n_steps,
            actions=len(recording.transitions),
            share_moved=recording.share_moved(),
            cuts=tuple(recording.cuts),
            learned_by=recording.header.controller if learned else None,
        )


def read_tested(
    path: Path,
    plays: Iterable[RecordingEntry] = (),
    goal_sets: Iterable[tuple[str | None, GoalSet]] = (),
    videos: Path | None = None,
    scenes: Iterable[str] = (),
) -> ResultEntry:
    """Read a result.

    Args:
        path: the result.
        plays: available recordings; the one that was learned from is found by its hash.
        goal_sets: that may have been tested, with their files (None: shipped); the same.
        videos: folder with a film of each trial.
        scenes: names and manifests of available scenes, besides those of the plays; the same.

    Raises:
        ResultError: it is not a result, or has no trial.
    """
    plays, result = list(plays), load_result(path)
    if not result.trials:
        raise ResultError(f"{path} has no trial yet")
    setting = result.setting
    run = next((play for play in plays if play.sha256 == setting.run_sha256), None)
    known = [pair for pair in goal_sets if pair[1].sha256 == setting.goals_sha256]
    run_file = run.file if run else f"<recording {setting.run_sha256[:12]}>"
    goals = known[0][0] if known else f"<goals {setting.goals_sha256[:12]}>"
    places = [setting.scene, *scenes, *(play.header.scene_source for play in plays)]
    last = _render_ends(result, places)
    headings, rows = score_columns(result)
    return ResultEntry(
        file=path.name,
        result=result,
        command=scoring_command(
            setting,
            run_file if setting.run_sha256 else None,
            goals,
            path.name,
            _learning_options(setting, run),
        ),
        headings=tuple(headings),
        rows=tuple(map(tuple, rows)),
        trials=tuple(_trials(result, known[0][1] if known else None, last, videos)),
    )


def _learning_options(setting: Setting, run: RecordingEntry | None) -> list[str]:
    """Options that say what it learned from the recording; the steps if that is unknown."""
    learned = setting.learned
    if setting.learned_from == "process":  # it plays again, and is tested at once
        return ["--steps", str(setting.run_steps)]
    if learned is not None:
        now = setting.controller_sha256, setting.settings
        return [] if (learned.code_sha256, learned.settings) == now else ["--keep-learned"]
    made = ["--as-made"] if setting.learned_from == "nothing" else []
    if run is None or run.steps != setting.run_steps:
        return ["--run-steps", str(setting.run_steps), *made]
    return made or (["--relearn"] if run.learned_by == setting.controller else [])


def _trials(
    result: Result,
    goal_set: GoalSet | None,
    last: list[Image] | list[None],
    videos: Path | None,
) -> Iterable[Trial]:
    goals = [None if goal_set is None else goal_set.goals[trial.goal] for trial in result.trials]
    masks = [image.mask for image in (*goals, *last) if image is not None]
    box = bounding_box_of_bodies(masks) if masks else (0, 0, 0, 0)
    numbers = [trial.goal for trial in result.trials]
    for trial, goal, end, film in zip(
        result.trials, goals, last, films(videos, numbers), strict=True
    ):
        yield Trial(
            result=trial,
            start=None if goal is None else picture(goal.retina_before, box),
            goal=None if goal is None else picture(goal.retina, box),
            end=None if end is None else picture(end.retina, box),
            film=film,
        )


def _render_ends(result: Result, places: Iterable[str]) -> list[Image] | list[None]:
    """Images of the ends, if one of the places has the scene, unchanged."""
    for place in dict.fromkeys(places):
        with suppress(SceneError):
            scene = load_scene(place)
            if scene.sha256 == result.setting.scene_sha256:
                return list(render_ends(result, scene))
    return [None] * len(result.trials)
