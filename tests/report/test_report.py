from __future__ import annotations

import re
import shlex
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from real_bench.goal_sets import load_goal_set, save_goal_set
from real_bench.report import Report, Table, read_played, read_tested
from real_bench.report.page import render
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from tests.cli.shell import realbench, tiny_goals
from tests.scoring.bench import made

HOSTILE = "<script>alert('x')</script>&\"'"


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory, builtin_scene: Scene) -> Path:
    """A short play, a test on two goals with films, and an experiment."""
    folder = tmp_path_factory.mktemp("report")
    save_goal_set(tiny_goals(builtin_scene), folder / "goals.npy")
    play = ["--controller", "real_r", "--condition", "OM", "--images", "--scene", "builtin"]
    realbench(folder, "intrinsic", *play, "--steps", "3000", "--seed", "3")
    test = ["--goals", "goals.npy", "--trial-steps", "2000"]
    realbench(folder, "extrinsic", *test, "--video", "films")
    (folder / "mine.yaml").write_text(
        f'title: "{HOSTILE.replace(chr(34), "")}"\nscene: builtin\nrun: false\n'
        "goals: {few: {seed: 5, counts: {2D: 2}}}\n"
        "cells: [{controller: real_r, condition: OM, published: {mean: 0.021}}]\n"
    )
    return folder


@pytest.fixture(scope="session")
def page(folder: Path) -> Path:
    """The report of all of it."""
    files = ["mine.yaml", "run.h5", "score.json"]
    options = ["--goals", "goals.npy", "--videos", "films"]
    realbench(folder, "report", *files, *options)
    return folder / "report.html"


def test_commands_in_the_report_reproduce_the_result(folder: Path) -> None:
    play = read_played(folder / "run.h5")
    goals = [("goals.npy", load_goal_set(folder / "goals.npy"))]
    test = read_tested(folder / "score.json", [play], goals)
    again = folder / "again"
    again.mkdir()
    (again / "goals.npy").write_bytes((folder / "goals.npy").read_bytes())
    for command in (play.command, test.command):
        realbench(again, *shlex.split(command)[1:])
    assert load_result(again / "score.json").trials == test.result.trials


def test_command_says_how_it_learned(folder: Path, tmp_path: Path) -> None:
    play = read_played(folder / "run.h5")
    setting: dict[str, Any] = {"run_sha256": play.sha256, "run_steps": 3000}
    kept = {"code_sha256": "c" * 64, "settings": {}}
    made([0.1], **setting, learned=kept, controller_sha256="c" * 64).save(tmp_path / "a.json")
    made([0.1], **setting, learned=kept, controller_sha256="d" * 64).save(tmp_path / "b.json")
    made([0.1], **setting).save(tmp_path / "c.json")
    made([0.1], **{**setting, "run_steps": 1000}).save(tmp_path / "d.json")
    for name, option in [("a", ""), ("b", "--keep-learned "), ("d", "--run-steps 1000 ")]:
        command = read_tested(tmp_path / f"{name}.json", [play]).command
        assert f"--run run.h5 {option}--goals" in command
    for learned_by, option in [("real_r", "--relearn "), (None, ""), ("real_d", "")]:
        entry = replace(play, learned_by=learned_by)
        command = read_tested(tmp_path / "c.json", [entry]).command
        assert f"--run run.h5 {option}--goals" in command


def test_only_settings_that_differ_from_defaults_are_shown(tmp_path: Path) -> None:
    settings = {"abstraction": {"levels": 200}, "planner": {"depth": 4}}
    made([0.1], controller="real_d", settings=settings).save(tmp_path / "a.json")
    assert "--set planner.depth=4 " in read_tested(tmp_path / "a.json").command
    assert "levels" not in read_tested(tmp_path / "a.json").command
    made([0.1], controller="gone.py", settings=settings).save(tmp_path / "b.json")
    assert "--set abstraction.levels=200" in read_tested(tmp_path / "b.json").command


def test_part_of_the_goals_and_other_lengths_are_shown(tmp_path: Path) -> None:
    made([0.1, 0.2], n_goals=5, goal_numbers=(0, 3), trial_steps=2000).save(tmp_path / "a.json")
    tested = read_tested(tmp_path / "a.json")
    assert "--trials 2 --trial-steps 2000 " in tested.command
    assert "2 of 5 goals, trials of 2,000 steps" in render(Report("title", tests=[tested]))
    assert tested.rows[-1][:2] == ("total", "2 of 5")
    made([0.1, 0.2]).save(tmp_path / "b.json")
    assert "--trial" not in read_tested(tmp_path / "b.json").command


def test_hostile_text_is_escaped(tmp_path: Path) -> None:
    fields: dict[str, Any] = {"controller": HOSTILE, "versions": {HOSTILE: HOSTILE}}
    made([0.1], scene=HOSTILE, **fields).save(tmp_path / "a.json")
    table = Table(HOSTILE, (HOSTILE,), ((HOSTILE,),), (HOSTILE,), HOSTILE)
    report = Report(HOSTILE, [table], [], [read_tested(tmp_path / "a.json")], [], [HOSTILE])
    assert "alert(" in render(report)
    assert "<script>alert" not in render(report)


def test_report_is_self_contained(page: Path) -> None:
    text = page.read_text()
    assert re.findall(r'(?:src|href)="(?!data:)[^"]*"', text) == []
    assert re.findall(r"url\(|@import|https?:", text.replace("http://www.w3.org", "")) == []
    assert text.count("data:image/webp") == 2 * 3
    assert text.count("data:video/mp4") == 2
    assert text.count("data:image/svg+xml") >= 3


def test_results_that_are_not_whole_are_shown_as_such(folder: Path, tmp_path: Path) -> None:
    """One that is not finished, one without a trial, and one that is given twice."""
    result = load_result(folder / "score.json")
    for name, n_trials in (("part.json", 1), ("none.json", 0)):
        result.model_copy(update={"trials": result.trials[:n_trials]}).save(tmp_path / name)
    for name in ("score.json", "copy.json"):
        (tmp_path / name).write_bytes((folder / "score.json").read_bytes())
    realbench(tmp_path, "report", "part.json", "none.json", "score.json", "copy.json")
    page = (tmp_path / "report.html").read_text()
    assert "the test is not finished: 1 of 2 trials" in page
    assert "none.json: has no trial yet" in page
    assert "no figures of scores: score.json and copy.json are of the same test" in page


def test_missing_goal_pictures_are_reported(folder: Path, tmp_path: Path) -> None:
    done = realbench(folder, "report", "score.json", "--out", tmp_path / "r.html")
    assert "no pictures of its goals; give its goal set with --goals" in done.stderr
    assert "no pictures of its goals" in (tmp_path / "r.html").read_text()


@pytest.mark.parametrize(
    ("scene", "told"),
    [
        (scene, f"its scene {scene} was not found as it was then: give the manifest with --scene")
        for scene in ("mylab", "builtin")
    ],
)
def test_report_says_why_there_are_no_pictures_of_ends(
    tmp_path: Path, scene: str, told: str
) -> None:
    made([0.1], scene=scene).save(tmp_path / "a.json")
    done = realbench(tmp_path, "report", "a.json")
    assert told in done.stderr


@pytest.mark.parametrize("by", ["--scene", "recording"])
def test_ends_in_a_scene_of_ones_own_are_pictured(
    tmp_path: Path, builtin_scene: Scene, by: str
) -> None:
    room = tmp_path / "room"
    shutil.copytree(builtin_scene.folder, room)
    manifest = (room / "scene.yaml").rename(room / "my.yaml")
    manifest.write_text(manifest.read_text().replace("name: builtin", "name: my"))
    made = ["goals", "generate", "--2d", "1", "--25d", "0", "--3d", "0", "--out", "goals.npy"]
    realbench(tmp_path, *made, "--scene", "room/my.yaml")
    play = ["--controller", "real_r", "--condition", "OM", "--scene", "room/my.yaml"]
    realbench(tmp_path, "intrinsic", *play, "--steps", "1000")
    realbench(tmp_path, "extrinsic", "--goals", "goals.npy", "--trial-steps", "1000")
    more = ["run.h5"] if by == "recording" else ["--scene", "room/my.yaml"]
    done = realbench(tmp_path, "report", "score.json", "--goals", "goals.npy", *more)
    assert "no pictures" not in done.stderr
    assert (tmp_path / "report.html").read_text().count("data:image/webp") == 3


@pytest.mark.parametrize(
    ("files", "code", "told"),
    [
        (["run.h5", "--videos", "films"], 1, "--videos needs exactly one result, not 0"),
        (["goals.npy"], 2, "goal set"),
        (["no.h5"], 1, "recording not found: no.h5"),
    ],
)
def test_bad_report_arguments_are_refused(
    folder: Path, tmp_path: Path, files: list[str], code: int, told: str
) -> None:
    done = realbench(folder, "report", *files, "--out", tmp_path / "r.html", code=code)
    assert told in done.stderr
    assert not (tmp_path / "r.html").exists()


def test_existing_report_is_not_overwritten(folder: Path, page: Path) -> None:
    done = realbench(folder, "report", "score.json", code=1)
    assert "report.html exists" in done.stderr


@pytest.mark.parametrize("width", [1200, 390])
def test_browser_shows_and_sorts_the_report(browser: Any, page: Path, width: int) -> None:
    tab = browser.new_page(viewport={"width": width, "height": 900})
    told: list[str] = []
    asked: list[str] = []
    tab.on("console", lambda message: told.append(message.text))
    tab.on("pageerror", lambda error: told.append(str(error)))
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(page.as_uri())

    def scores() -> list[float]:
        cells = tab.locator('.goals td[data-name="score"]').all_text_contents()
        return [float(cell) for cell in cells]

    heading = tab.locator(".goals th button", has_text="score")
    heading.click()
    assert scores() == sorted(scores())
    assert tab.locator('.goals th[aria-sort="ascending"]').count() == 1
    heading.click()
    assert scores() == sorted(scores(), reverse=True)
    assert len(set(scores())) == 2
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    tab.evaluate("document.querySelectorAll('img').forEach(image => image.loading = 'eager')")
    tab.wait_for_function("[...document.images].every(image => image.complete)")
    assert tab.evaluate("[...document.images].every(image => image.naturalWidth > 0)")
    assert len(tab.screenshot(full_page=True)) > 20_000
    assert told == []
    assert [url for url in asked if not url.startswith(("data:", "file:"))] == []
