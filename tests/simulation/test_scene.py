"""Scene manifests: what is accepted, what is refused, what the hash covers."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml

from real_bench.errors import SceneError
from real_bench.simulation import Simulation, load_scene
from real_bench.simulation.scene import shipped_scenes

BUILTIN = shipped_scenes()["builtin"].parent


@pytest.fixture
def own_scene(tmp_path: Path) -> Path:
    """A user's scene: a copy of the builtin one under another name."""
    folder = tmp_path / "own"
    shutil.copytree(BUILTIN, folder)
    edit(folder / "scene.yaml", name="own")
    return folder / "scene.yaml"


def edit(path: Path, **changes: Any) -> None:
    content = yaml.safe_load(path.read_text())
    content.update(changes)
    path.write_text(yaml.safe_dump(content))


def test_a_user_can_write_a_scene(own_scene: Path) -> None:
    camera = yaml.safe_load(own_scene.read_text())["camera"]
    edit(own_scene, camera={**camera, "width": 64, "height": 48})
    with Simulation(load_scene(own_scene)) as simulation:
        assert simulation.image().retina.shape == (48, 64, 3)
    assert load_scene(own_scene.parent).name == "own"


def test_the_hash_covers_the_manifest_and_every_file(own_scene: Path) -> None:
    before = load_scene(own_scene).sha256
    urdf = own_scene.parent / "cube.urdf"
    urdf.write_text(urdf.read_text() + "<!-- changed -->")
    changed_file = load_scene(own_scene).sha256
    camera = yaml.safe_load(own_scene.read_text())["camera"]
    edit(own_scene, camera={**camera, "near": 0.2})
    assert len({before, changed_file, load_scene(own_scene).sha256}) == 3


def test_the_hash_does_not_cover_where_goals_are_drawn(own_scene: Path) -> None:
    before = load_scene(own_scene).sha256
    goals = yaml.safe_load(own_scene.read_text())["goals"]
    edit(own_scene, goals={**goals, "table_drop_height": 0.5})
    assert load_scene(own_scene).sha256 == before


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"camera": 3}, "camera"),
        ({"objects": []}, "objects"),
        ({"colour": "red"}, "colour"),
        ({"name": "../evil"}, "name"),
        ({"assets": {"wheel": "x==1"}}, "sha256"),
        ({"table": {"urdf": "table.urdf", "position": [0, 0, float("nan")]}}, "position"),
    ],
)
def test_wrong_manifest_gives_a_one_line_error_naming_the_field(
    own_scene: Path, change: dict[str, Any], message: str
) -> None:
    edit(own_scene, **change)
    with pytest.raises(SceneError, match=message) as error:
        load_scene(own_scene)
    assert "\n" not in str(error.value)


def test_all_faults_of_a_manifest_are_reported_at_once(own_scene: Path) -> None:
    edit(own_scene, camera=3, objects=[])
    with pytest.raises(SceneError, match=r"camera.*; objects|objects.*; camera"):
        load_scene(own_scene)


@pytest.mark.parametrize("content", ["", "[1, 2]", "a: [", "x: !!python/object:os.system {}"])
def test_malformed_manifests_are_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(content)
    with pytest.raises(SceneError):
        load_scene(path)


def test_an_unknown_scene_names_the_known_ones() -> None:
    with pytest.raises(SceneError, match=r"unknown scene 'kitchen': use builtin or official"):
        load_scene("kitchen")


def test_a_missing_urdf_is_named(own_scene: Path) -> None:
    (own_scene.parent / "cube.urdf").unlink()
    with pytest.raises(SceneError, match=r"file not found: .*cube\.urdf"):
        Simulation(load_scene(own_scene))


def test_error_for_missing_official_scene_names_both_remedies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    with pytest.raises(SceneError, match=r"`realbench scene install`.*`--scene builtin`"):
        load_scene("official")
