from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from real_bench.conditions import Condition
from real_bench.controller_code.source import ControllerSource
from real_bench.errors import ExperimentError
from real_bench.experiments import Spec, read_spec
from real_bench.experiments.job_state import JobState, state_of
from real_bench.experiments.plan import ExperimentPlan
from real_bench.experiments.running import Experiment
from real_bench.experiments.scores import Row, rows_of
from real_bench.experiments.table import cells, json_table, latex_table, markdown_table, notes
from real_bench.goal_sets import generate_goal_set, save_goal_set
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.local import LocalBackend
from real_bench.recording import Recorder
from real_bench.scoring.repeats import by_goal, summarise_repeats
from real_bench.simulation import Scene, load_scene
from real_bench.version import SOURCE
from tests.cli.shell import realbench
from tests.experiments.conftest import DISTANCES, WriteSpec, keep
from tests.scoring.bench import made


def test_rows_are_empty_before_any_work(spec: Spec) -> None:
    rows = rows_of(spec, ExperimentPlan(spec))
    assert [(row.seeds, row.n_asked, row.summary, row.difference) for row in rows] == [
        ((), 2, None, None),
        ((), 2, None, None),
        ((), 1, None, None),
    ]
    assert notes(spec, rows)[-1] == "5 of 5 repeats are missing"


def test_row_summarises_its_repeats(drawn: Spec) -> None:
    files = [keep(drawn, repeat=0), keep(drawn, repeat=1)]
    row = rows_of(drawn, ExperimentPlan(drawn))[0]
    assert row.summary is not None
    scores = np.exp(-np.log(4) / 0.1 * np.array([DISTANCES[0], DISTANCES[1]]))
    assert row.summary.score.mean == pytest.approx(scores.mean())
    assert row.summary.score.standard_error == pytest.approx(
        scores.mean(axis=1).std(ddof=1) / np.sqrt(2)
    )
    assert row.summary.score.by_repeat == pytest.approx(tuple(scores.mean(axis=1)))
    assert row.difference == pytest.approx(scores.mean() - 0.021)
    assert (row.seeds, row.files) == ((0, 1), tuple(files))
    assert not row.is_enough
    assert any("too few to compare" in note for note in notes(drawn, [row]))


def test_incomplete_repeat_does_not_count(drawn: Spec) -> None:
    keep(drawn, repeat=0)
    keep(drawn, repeat=1, n_trials=1)
    row = rows_of(drawn, ExperimentPlan(drawn))[0]
    assert row.seeds == (0,)
    assert row.summary is not None
    assert row.summary.score.standard_error is None
    assert row.summary.score.interval is not None
    assert row.summary.score.interval.over == "goals"  # one play
    assert cells(row)[6] == "-"
    left = ExperimentPlan(drawn).pending()
    assert [job.name for job in left.scorings][:1] == ["real_r-OM-1-seed1-few"]
    assert [job.name for job in left.plays] == ["random-1-seed0", "random-1-seed1"]


def test_finished_tests_are_made_again_with_their_play_or_it_is_refused(drawn: Spec) -> None:
    kept = keep(drawn, repeat=0)
    left = ExperimentPlan(drawn).pending()
    assert "random-1-seed0" in [job.name for job in left.plays]  # for another cell
    assert [job.out for job in left.outdated] == [kept]
    with pytest.raises(
        ExperimentError, match=r"random-1-seed0 must be played again, .*--overwrite"
    ):
        Experiment(drawn).check(left)
    left = ExperimentPlan(drawn).pending(overwrite=True)
    assert kept in [job.out for job in left.scorings]
    assert not left.outdated


def test_play_that_no_test_needs_is_not_made(drawn: Spec) -> None:
    for cell in (0, 1):
        keep(drawn, cell, repeat=0)
    assert [job.name for job in ExperimentPlan(drawn).pending().plays] == ["random-1-seed1"]


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"condition": "OJ"}, "condition OJ, not OM"),
        ({"controller": "real_t"}, "controller real_t, not real_r"),
        ({"scene": "official"}, "scene official, not builtin"),
        ({"seed": 7}, "seed 7, not 0"),
        ({"trial_steps": 10_000}, "trial steps 10000, not 500"),
        ({"run_steps": 15_000_000}, "run steps 15000000, not 2000"),
        ({"n_goals": 3}, "3 goals, not 2"),
        ({"goals_sha256": "9" * 64}, r"other goals than goals-few-1\.npy"),
    ],
)
def test_result_of_another_experiment_is_refused(
    drawn: Spec, changes: dict[str, Any], told: str
) -> None:
    kept = keep(drawn, **changes)
    with pytest.raises(ExperimentError, match=f"{kept.name} does not belong here: .*{told}"):
        rows_of(drawn, ExperimentPlan(drawn))
    with pytest.raises(ExperimentError, match=told):
        ExperimentPlan(drawn).pending()
    assert kept.stem in [job.name for job in ExperimentPlan(drawn).pending(overwrite=True).scorings]


def test_result_with_other_settings_is_refused(write_spec: WriteSpec, builtin_scene: Scene) -> None:
    cell = {"controller": "real_d", "condition": "OM", "settings": {"planner": {"depth": 4}}}
    spec = read_spec(write_spec(cells=[cell]))
    spec.results_folder.mkdir()
    list(ExperimentPlan(spec).goals.draw())
    keep(spec, settings={"planner": {"depth": 4, "more": 1}})
    assert rows_of(spec, ExperimentPlan(spec))[0].seeds == (0,)
    keep(spec, settings={"planner": {"depth": 10}})
    with pytest.raises(ExperimentError, match="settings"):
        rows_of(spec, ExperimentPlan(spec))


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"scene_sha256": "8" * 64}, "scenes"),
        ({"settings": {"depth": 3}}, "settings"),
        ({"control_version": 2}, "versions of its control"),
        ({"learned": {"code_sha256": "7" * 64, "settings": {"lr": 2}}}, "settings that learned"),
    ],
)
def test_results_that_differ_are_never_averaged(
    drawn: Spec, changes: dict[str, Any], what: str
) -> None:
    keep(drawn, repeat=0, learned={"code_sha256": "7" * 64, "settings": {"lr": 1}})
    keep(drawn, repeat=1, **changes)
    with pytest.raises(ExperimentError, match=f"different {what}, which are never averaged"):
        rows_of(drawn, ExperimentPlan(drawn))


@pytest.mark.parametrize(("second", "is_mixed"), [("a" * 16, False), ("b" * 16, True)])
def test_averages_over_different_code_are_named(drawn: Spec, second: str, is_mixed: bool) -> None:
    keep(drawn, repeat=0, versions={SOURCE: "a" * 16})
    keep(drawn, repeat=1, versions={SOURCE: second})
    row = rows_of(drawn, ExperimentPlan(drawn))[0]
    told = [note for note in notes(drawn, [row]) if "different code of realbench" in note]
    assert [note.endswith(f": {row.cell.name}") for note in told] == [True] * is_mixed
    assert row.to_json()["sources"] == sorted({"a" * 16, second})


def test_result_of_a_controller_changed_since_is_refused(
    write_spec: WriteSpec, tmp_path: Path, builtin_scene: Scene
) -> None:
    code = "from real_bench.controllers.real_r import RealR\nclass Mine(RealR):\n    pass\n"
    (tmp_path / "mine.py").write_text(code)
    spec = read_spec(write_spec(cells=[{"controller": "mine.py", "condition": "OM"}]))
    spec.results_folder.mkdir()
    list(ExperimentPlan(spec).goals.draw())
    sha256 = ControllerSource.of(str(tmp_path / "mine.py")).code_sha256
    keep(spec, controller="/elsewhere/mine.py", controller_sha256=sha256)
    assert rows_of(spec, ExperimentPlan(spec))[0].seeds == (0,)
    (tmp_path / "mine.py").write_text(code + "# better\n")
    with pytest.raises(ExperimentError, match=r"mine\.py, or other Python code in its folder"):
        rows_of(spec, ExperimentPlan(spec))


def test_other_goals_under_the_same_name_are_refused(
    write_spec: WriteSpec, tmp_path: Path, builtin_scene: Scene
) -> None:
    path = tmp_path / "mine.npy"
    save_goal_set(generate_goal_set(builtin_scene, 1, seed=5, counts={"2D": 2}), path)
    spec = read_spec(write_spec(goals={"few": "mine.npy"}))
    spec.results_folder.mkdir()
    keep(spec)
    save_goal_set(generate_goal_set(builtin_scene, 1, seed=6, counts={"2D": 2}), path)
    with pytest.raises(ExperimentError, match="other goals"):
        rows_of(spec, ExperimentPlan(spec))


def test_every_format_holds_every_row(drawn: Spec) -> None:
    keep(drawn, repeat=0)
    keep(drawn, repeat=1)
    rows = rows_of(drawn, ExperimentPlan(drawn))
    mean = rows[0].summary.score.mean if rows[0].summary else 0
    markdown, latex = markdown_table(drawn, rows), latex_table(drawn, rows)
    for text in (markdown, latex):
        assert f"{mean:.3f}" in text
        assert "real" in text
        assert "2 of 2" in text
        assert "0 of 1" in text
    assert latex.count(r"\\") == 4
    assert "±" not in latex
    told = json.loads(json.dumps(json_table(drawn, rows)))
    assert told["rows"][0]["summary"]["metrics"]["score"]["mean"] == mean
    assert told["rows"][0]["published"]["standard_error"] == 0.002
    assert told["rows"][1]["summary"] is None


def test_rows_of_different_goals_say_so(write_spec: WriteSpec, builtin_scene: Scene) -> None:
    goals = {name: {"seed": seed, "counts": {"2D": 2}} for seed, name in enumerate(("few", "more"))}
    cells = [
        {"name": "one", "controller": "real_r", "condition": "OM", "play": "none", "repeats": 1},
        {"name": "two", "controller": "real_r", "condition": "IM", "play": "none", "repeats": 1},
    ]
    for sets in (["few"], ["few", "more"]):
        spec = read_spec(write_spec(goals=goals, cells=[cells[0], {**cells[1], "goals": sets}]))
        rows = [
            Row(cell, 1, (0,), (), None, summarise_repeats(by_goal([made([0.1, 0.2])])))
            for cell in spec.cells
        ]
        told = [note for note in notes(spec, rows) if "different goals" in note]
        assert bool(told) == (sets == ["few"])  # the other row is of both
        assert "(none in one, two)" in notes(spec, rows)[0]
        assert json_table(spec, rows)["notes"] == notes(spec, rows)


def test_play_killed_at_once_counts_as_unfinished(drawn: Spec) -> None:
    job = ExperimentPlan(drawn).pending().plays[0]
    phase = IntrinsicPhase(
        "real_r", Condition.parse("OM"), 1, load_scene("builtin"), 2000, 0, job.out
    )
    header = phase._header(LocalBackend().identity("real_r", {}))
    camera = phase.scene.manifest.camera
    with Recorder.begin(job.out, header, 4, 2000, camera, overwrite=False):
        assert state_of(job) == JobState(ended=False)
    assert job.name in [play.name for play in ExperimentPlan(drawn).pending().plays]


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"steps": 3000}, "steps 2000, not 3000"),
        ({"seed": 1}, "does not belong here: seed"),
    ],
)
def test_a_play_of_another_experiment_is_refused(
    drawn: Spec, write_spec: WriteSpec, changes: dict[str, Any], told: str
) -> None:
    plan = ["--controller", "real_r", "--condition", "OM", "--scene", "builtin"]
    out = ExperimentPlan(drawn).pending().plays[0].out
    realbench(drawn.folder, "intrinsic", *plan, "--steps", "2000", "--out", out)
    other = read_spec(write_spec(**changes))
    if "seed" in changes:
        out.rename(out.with_name("random-1-seed1.h5"))
    with pytest.raises(ExperimentError, match=told):
        ExperimentPlan(other).pending()


def test_other_lengths_and_goals_than_published_are_marked(
    drawn: Spec, write_spec: WriteSpec
) -> None:
    keep(drawn, repeat=0)
    rows = rows_of(drawn, ExperimentPlan(drawn))
    assert rows[0].unlike_published == (
        "goals in other proportions than 25 2D, 15 2.5D, 10 3D",
        "scene builtin instead of official",
        "2,000 steps of play instead of 15,000,000",
        "trials of 500 steps instead of 10,000",
    )
    assert rows[1].unlike_published == ()  # there is nothing published beside it
    page = markdown_table(drawn, rows)
    assert re.search(r"\| 0\.021 ± 0\.002† +\| \+0\.\d{3}\*† +\|\n", page)
    assert "† not what was published: 2,000 steps of play instead of 15,000,000" in page
    assert "\nscene builtin, 2,000 steps of play (none in real" in page
    assert "trials of 500 steps" in page
    assert "†" not in "".join(cells(rows[1]))


def test_part_of_the_goals_is_no_repeat_and_is_continued(drawn: Spec) -> None:
    keep(drawn, n_trials=1, goal_numbers=(0,))
    assert rows_of(drawn, ExperimentPlan(drawn))[0].seeds == ()
    assert "real_r-OM-1-seed0-few" in [job.name for job in ExperimentPlan(drawn).pending().scorings]
