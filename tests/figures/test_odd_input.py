"""Recordings and results from which not everything can be drawn."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from real_bench.errors import RealBenchError
from real_bench.figures import (
    FIGURES,
    FigureData,
    FigureOptions,
    check_same_goals,
    play_labels,
    read_play,
    read_tested,
)
from real_bench.figures.tested import check_given_once, series
from real_bench.recording.schema import LOGGED, with_text
from real_bench.scoring.result import Learned, Result
from tests.figures.bench import FEW_STEPS, OPTIONS, Test, made_up, only, read, reread

ALL = {kind.name for kind in FIGURES}
LATENT = {"effective-actions-latent", "latent-distances", "latent-distances-near"}
SCORES = {"score-by-goal", "score-by-length"}


def drawn(material: FigureData, asked: set[str] = ALL) -> set[str]:
    """Which of the figures that are asked for can be drawn."""
    kinds = [kind for kind in FIGURES if kind.name in asked]
    return {kind.name for kind in kinds if kind.draw(material) is not None}


def test_every_figure_is_drawn_from_complete_data(material: FigureData) -> None:
    assert drawn(FigureData(only(material, "pushed").plays, material.tested)) == ALL


@pytest.mark.parametrize(("name", "silent"), [("one", set()), ("two", {"logged"})])
def test_recordings_without_images_get_no_latent_figures(
    material: FigureData, name: str, silent: set[str]
) -> None:
    assert drawn(only(material, name)) == ALL - LATENT - SCORES - silent


def test_recording_whose_codes_cannot_be_learned_is_in_the_other_figures(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    too_fast = FigureOptions({"vae": {"steps": 5, "rate": 1e30}})
    plays = read(folder / "pushed.h5", folder / "learned.h5", options=too_fast)
    assert [play.sight for play in plays] == [None, None]
    assert drawn(FigureData(plays), LATENT | {"effective-actions"}) == {"effective-actions"}
    warnings = [record.message for record in caplog.records if record.levelname == "WARNING"]
    assert len(warnings) == 2
    for name, warning in zip(("pushed", "learned"), warnings, strict=True):
        assert warning.startswith(f"{name}.h5 is in no figure of codes: the VAE diverged in epoch ")


def test_lengths_are_not_drawn_where_nothing_moved(material: FigureData) -> None:
    (still,) = only(material, "still").plays
    nothing = replace(still, displacements=np.zeros_like(still.displacements))
    assert drawn(FigureData((nothing,)), {"action-lengths"}) == set()


def test_near_distances_are_not_drawn_for_identical_pairs(material: FigureData) -> None:
    (still,) = only(material, "still").plays
    assert still.sight is not None
    alike = replace(still.sight.pairs, real=np.zeros_like(still.sight.pairs.real))
    nothing = FigureData((replace(still, sight=replace(still.sight, pairs=alike)),))
    assert drawn(nothing, LATENT) == LATENT - {"latent-distances-near"}


def test_nothing_is_drawn_without_a_whole_action(folder: Path) -> None:
    plays = read(folder / "pushed.h5", options=FigureOptions(FEW_STEPS, run_steps=999))
    assert drawn(FigureData(plays)) == set()


def test_run_steps_limits_what_is_read(folder: Path, material: FigureData) -> None:
    (short,) = read(folder / "two.h5", options=FigureOptions(run_steps=2000))
    (whole,) = only(material, "two").plays
    assert short.ended_at.tolist() == whole.ended_at[: len(short.ended_at)].tolist()
    assert len(short.ended_at) == len(short.displacements) < len(whole.ended_at)


def test_only_coverage_needs_the_scene(material: FigureData) -> None:
    (pushed,) = only(material, "pushed").plays
    assert drawn(FigureData((replace(pushed, region=None),))) == ALL - SCORES - {"coverage"}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"settings": {"vae": {"wait": 1}}}, r"bad settings: vae.wait.*vae.weight=1000"),
        ({"seed": -1}, "seed must be a whole number from 0 to 2\\*\\*63 - 1, not -1"),
        ({"run_steps": 0}, "run steps must be a whole number of at least 1, not 0"),
    ],
)
def test_bad_options_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(RealBenchError, match=message):
        FigureOptions(**options)  # type: ignore[arg-type]


def test_more_steps_than_recorded_are_refused(folder: Path) -> None:
    with pytest.raises(RealBenchError, match=r"one.h5 has 1,000 steps, 1,001 were asked for"):
        read_play(folder / "one.h5", "one", FigureOptions(run_steps=1001))


def test_results_of_other_goals_are_refused(tmp_path: Path) -> None:
    one, other = made_up(Test(), [0.1, 0.2]), made_up(Test(goals="7" * 64), [0.1, 0.2])
    for tested in (reread(tmp_path, one, other), reread(tmp_path, one, made_up(Test(), [0.1]))):
        with pytest.raises(RealBenchError, match=r"result-0.json is of 2 goals of set 44444444"):
            check_same_goals(tested)
    check_same_goals(reread(tmp_path, one, one))
    check_same_goals(())


def changed(result: Result, **setting: object) -> Result:
    """The same result with another setting."""
    return result.model_copy(update={"setting": result.setting.model_copy(update=setting)})


def test_results_that_are_never_averaged_are_drawn_apart(tmp_path: Path) -> None:
    """Of another version of the control, or after what other code or settings learned."""
    distances = [0.1, 0.2]
    learned = Learned(code_sha256="1" * 64, settings={"rate": 1})
    settings: list[dict[str, object]] = [
        {"learned": learned},
        {"learned": learned, "control_version": 2},
        {"learned": learned.model_copy(update={"code_sha256": "8" * 64})},
        {"learned": learned.model_copy(update={"settings": {"rate": 2}})},
    ]
    plain, older, by_code, by_settings = (
        changed(made_up(Test(run=str(number) * 64), distances), **changes)
        for number, changes in enumerate(settings)
    )
    again = changed(made_up(Test(run="9" * 64), distances), learned=learned)
    assert [len(one.results) for one in series(reread(tmp_path, plain, again), {})] == [2]
    for other, told in (
        (older, "control version 2"),
        (by_code, "learned by code 888888"),
        (by_settings, "learned with rate=2"),
    ):
        found = series(reread(tmp_path, plain, other), {})
        assert [len(one.results) for one in found] == [1, 1]
        assert found[1].controller.endswith(told)


def test_same_test_given_twice_is_refused_by_name(tmp_path: Path) -> None:
    twice = reread(tmp_path, *[made_up(Test(), [0.1, 0.2])] * 2)
    with pytest.raises(RealBenchError, match=r"result-0.json and result-1.json are of the same"):
        check_given_once(twice)


def test_any_number_may_be_logged_and_any_name_be_long(material: FigureData) -> None:
    (pushed,) = only(material, "pushed").plays
    largest = float(np.finfo(np.float64).max)
    values = [0.0, largest, -largest, np.nan, np.inf, -np.inf, 1e300]
    rows = np.zeros(len(values) * 20, LOGGED)
    rows["name"] = [f"name {number % 20} {'x' * 50}"[:64] for number in range(len(rows))]
    rows["value"] = np.repeat(values, 20)
    long = replace(pushed, logged=with_text(rows), label="first-attempt " * 30)
    found = FigureData((long, replace(long, label="second-attempt " * 30)))
    for kind in FIGURES:
        drawing = kind.draw(found)
        if drawing is not None:
            assert drawing.png()
            assert _inside(drawing.figure)


def _inside(figure: Figure) -> bool:
    """Whether all that is written lies on the page."""
    page = figure.bbox
    legends = [*figure.legends, *filter(None, (each.get_legend() for each in figure.axes))]
    titles = [each.title for each in figure.axes if each.title.get_text()]
    boxes = [each.get_window_extent() for each in (*legends, *titles)]
    return all(
        box.x0 >= page.x0 - 1 and box.x1 <= page.x1 + 1 and box.y1 <= page.y1 + 1 for box in boxes
    )


def test_labels_show_what_distinguishes_recordings(folder: Path) -> None:
    paths = [folder / f"{name}.h5" for name in ("pushed", "one", "two", "learned")]
    assert play_labels(paths) == [
        "pusher OM, seed 0 (pushed)",
        "pusher OM, seed 0 (one)",
        "REAL-R OM, 2 objects",
        "REAL-LD IM",
    ]
    assert play_labels(paths[:1]) == ["pusher OM"]
    assert str(paths[0]) in play_labels([paths[0], paths[0]])[1]


def test_series_are_labelled_by_what_differs(tmp_path: Path) -> None:
    results = reread(
        tmp_path,
        made_up(Test(), [0.1], vae={"weight": 1, "steps": 9}),
        made_up(Test(), [0.1], vae={"weight": 2, "steps": 9}),
        made_up(Test("real_d"), [0.1]),
        made_up(Test("real_d", code="8" * 64), [0.1]),
        made_up(Test("mine.py:Mine", run="9" * 64), [0.1]),
        made_up(Test("mine.py:Mine"), [0.1]),
    )
    labels = [(one.controller, len(one.results)) for one in FigureData((), results).series]
    assert labels == [
        ("REAL-LD, vae.weight=1", 1),
        ("REAL-LD, vae.weight=2", 1),
        ("REAL-D, code 222222", 1),
        ("REAL-D, code 888888", 1),
        ("Mine", 2),
    ]


def test_label_names_who_played_where_known(folder: Path, tmp_path: Path) -> None:
    plays = read(folder / "one.h5", folder / "two.h5", options=OPTIONS)
    runs = [play.sha256 for play in plays]
    results = reread(tmp_path, *(made_up(Test(run=run), [0.1]) for run in runs))
    told = [one.controller for one in FigureData(plays, results).series]
    assert told == ["REAL-LD, play of pusher", "REAL-LD"]  # REAL-R plays as REAL-LD does
    assert [len(one.results) for one in FigureData((), results).series] == [2]


def test_foreign_json_is_not_read_as_a_result(tmp_path: Path) -> None:
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(RealBenchError, match=r"other.json is not a result"):
        read_tested(tmp_path / "other.json")
