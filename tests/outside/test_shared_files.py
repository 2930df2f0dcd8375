"""What is given to others says nothing of where it was made."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from real_bench.goal_sets import save_goal_set
from real_bench.simulation import Scene
from tests.cli.shell import realbench, tiny_goals, write_controller


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory, builtin_scene: Scene) -> Path:
    """A controller played, tested, tabled and reported, all by absolute paths."""
    folder = tmp_path_factory.mktemp("a-home-of-somebody")
    save_goal_set(tiny_goals(builtin_scene), folder / "goals.npy")
    controller = folder / "mine.py"
    write_controller(controller, "pass")
    run, score, spec = folder / "run.h5", folder / "score.json", folder / "small.yaml"
    play = ("--condition", "OM", "--scene", "builtin", "--steps", "2000")
    realbench(folder, "intrinsic", "--controller", controller, *play, "--out", run)
    test = ("--run", run, "--goals", folder / "goals.npy", "--trial-steps", "1000")
    realbench(folder, "extrinsic", *test, "--out", score)
    lines = [
        *("scene: builtin", "steps: 2000", "trial_steps: 1000", "repeats: 1"),
        f"goals: {{few: {folder / 'goals.npy'}}}",
        f"cells: [{{controller: {controller}, condition: OM}}]",
    ]
    spec.write_text("\n".join(lines))
    (folder / "table.json").write_text(realbench(folder, "table", spec, "--json").stdout)
    report = ("report", spec, run, score, "--goals", folder / "goals.npy")
    realbench(folder, *report, "--out", folder / "report.html")
    judge = ("score", score, "--goals", folder / "goals.npy")
    files = ("--markdown", folder / "summary.md", "--junit", folder / "junit.xml")
    realbench(folder, *judge, *files, code=3)  # its trials are too short
    return folder


@pytest.mark.parametrize(
    "file",
    [
        "score.json",
        "small/mine-OM-1-seed0-few.json",
        "table.json",
        "report.html",
        "summary.md",
        "junit.xml",
    ],
)
def test_shared_files_contain_no_folder_of_the_user(place: Path, file: str) -> None:
    text = (place / file).read_text()
    assert "mine" in text
    assert "a-home-of-somebody" not in text
    assert str(Path.home()) + "/" not in text


def test_controller_is_still_found_from_elsewhere(place: Path) -> None:
    assert json.loads((place / "score.json").read_text())["setting"]["controller"] == "mine.py"
    test = ("extrinsic", "--run", place / "run.h5", "--goals", place / "goals.npy")
    realbench(Path("/"), *test, "--trial-steps", "1000", "--out", place / "again.json")
