"""Goals are those that the experiment asks for, each set once."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from real_bench.experiments import Spec, read_spec
from real_bench.goal_sets import load_goal_set, save_goal_set
from real_bench.simulation import Scene
from tests.cli.shell import realbench, tiny_goals
from tests.experiments.conftest import WriteSpec, keep

RANDOM = {"controller": "real_r", "condition": "OM", "play": "none"}


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ({"seed": 99, "counts": {"2D": 2}}, "seed 5, not 99"),
        ({"seed": 5, "counts": {"2D": 7}}, "2 of 2D, not 7 of 2D"),
        ({"seed": 5}, "2 of 2D, not 25 of 2D, 15 of 2.5D, 10 of 3D"),
    ],
)
def test_goals_drawn_otherwise_are_refused(
    drawn: Spec, write_spec: WriteSpec, tmp_path: Path, source: dict[str, Any], told: str
) -> None:
    path = write_spec(cells=[RANDOM], goals={"few": source})
    for options in ((), ("--no-run",)):
        refused = realbench(tmp_path, "table", path, *options, code=1).stderr
        assert f"goals-few-1.npy does not belong here: {told}" in refused
        assert "replace them with --overwrite" in refused


def test_overwrite_draws_such_goals_anew(
    drawn: Spec, write_spec: WriteSpec, tmp_path: Path
) -> None:
    kept = keep(drawn, 0, run_steps=0)
    path = write_spec(cells=[RANDOM], repeats=1, goals={"few": {"seed": 6, "counts": {"3D": 1}}})
    realbench(tmp_path, "table", path, "--overwrite")
    goals = load_goal_set(drawn.results_folder / "goals-few-1.npy")
    assert (goals.seed, goals.classes) == (6, ("3D",))
    assert goals.sha256 in kept.read_text()
    assert "1 of 1" in realbench(tmp_path, "table", path).stdout


def test_goals_of_another_scene_are_refused(
    drawn: Spec, write_spec: WriteSpec, tmp_path: Path, builtin_scene: Scene
) -> None:
    shutil.copytree(builtin_scene.folder, tmp_path / "room", dirs_exist_ok=True)
    (manifest,) = (tmp_path / "room").glob("*.yaml")
    manifest.write_text(manifest.read_text().replace("name: builtin", "name: room"))
    path = write_spec(cells=[RANDOM], scene=str(manifest))
    refused = realbench(tmp_path, "table", path, code=1).stderr
    assert "goals-few-1.npy does not belong here: scene builtin, not room" in refused


def test_a_set_twice_is_refused_before_work(
    write_spec: WriteSpec, tmp_path: Path, builtin_scene: Scene
) -> None:
    for name in ("first.npy", "second.npy"):
        save_goal_set(tiny_goals(builtin_scene), tmp_path / name)
    sets: list[dict[str, Any]] = [
        {"first": "first.npy", "second": "second.npy"},
        {"first": {"seed": 5, "counts": {"2D": 2}}, "second": {"seed": 5, "counts": {"2D": 2}}},
    ]
    for goals in sets:
        path = write_spec(cells=[RANDOM], goals=goals)
        refused = realbench(tmp_path, "table", path, code=1).stderr
        assert "goals first and second of cell real_r-OM-1 are the same" in refused
        assert not list((tmp_path / "results").glob("*.json"))
    apart = [{**RANDOM, "goals": ["first"]}, {**RANDOM, "name": "b", "goals": ["second"]}]
    assert read_spec(write_spec(cells=apart, goals=sets[0]))
    realbench(tmp_path, "table", write_spec(cells=apart, goals=sets[0], repeats=1))
