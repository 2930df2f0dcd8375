"""The goal sets that ship: for both scenes, as their page says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from real_bench.errors import GoalSetError
from real_bench.goal_sets import OFFICIAL_COUNTS, load_goal_set, shipped_goal_set, shipped_sizes
from real_bench.simulation import Scene
from tests.cli.shell import realbench

PAGE = (Path(__file__).parents[2] / "goals" / "README.md").read_text()
ROWS = re.findall(
    r"^\| `(\S+)` \| (\w+) \| ([\w, ]+) \| (\d+) \| `(\w{64})` \|$", PAGE, re.MULTILINE
)


def test_page_has_one_row_per_set() -> None:
    assert len(ROWS) == len(list((Path(__file__).parents[2] / "goals").glob("*.npy"))) == 6


@pytest.mark.parametrize("row", ROWS, ids=[row[0] for row in ROWS])
def test_set_matches_its_page(row: tuple[str, str, str, str, str]) -> None:
    file, scene, objects, seed, sha256 = row
    names = tuple(objects.split(", "))
    path = shipped_goal_set(len(names), scene)
    goal_set = load_goal_set(path)
    assert path.name == file
    assert (goal_set.scene, goal_set.object_names) == (scene, names)
    assert (str(goal_set.seed), goal_set.sha256) == (seed, sha256)
    assert goal_set.counts == OFFICIAL_COUNTS
    assert shipped_sizes(len(names), scene) == {sha256: 50}
    assert goal_set.scene_sha256 in PAGE


@pytest.mark.parametrize("scene", ["mine", "../goals", "official/.."])
def test_no_set_ships_for_other_scenes(scene: str) -> None:
    with pytest.raises(GoalSetError, match="no goal set ships for 1 object"):
        shipped_goal_set(1, scene)
    assert shipped_sizes(1, scene) == {}


def test_everything_works_without_the_official_scene(
    tmp_path: Path, builtin_scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "nothing-installed"))
    play = ("--controller", "real_r", "--condition", "OM", "--scene", "builtin")
    realbench(tmp_path, "intrinsic", *play, "--steps", "2000")
    realbench(tmp_path, "extrinsic", "--trials", "2", "--trial-steps", "1000")
    told = realbench(tmp_path, "score", "score.json", "--allow-part", code=3)  # too short
    assert "the shipped" in told.stdout
    realbench(tmp_path, "verify", "score.json", "--allow-incomplete")
    realbench(tmp_path, "report", "run.h5", "score.json")
