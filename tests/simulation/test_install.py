"""Installing a scene from a wheel: checked, data only, all or nothing."""

from __future__ import annotations

import hashlib
import zipfile
from pathlib import Path

import pytest

from real_bench.errors import SceneError
from real_bench.simulation.install import _replace_folder, install_scene
from real_bench.simulation.manifest import Manifest
from real_bench.simulation.scene import manifest_path, read_manifest


@pytest.fixture
def wheel(tmp_path: Path) -> Path:
    path = tmp_path / "toys-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("toys/data/cube.urdf", "<robot/>")
        archive.writestr("toys/data/meshes/cube.obj", "v 0 0 0")
        archive.writestr("toys/data/__init__.py", "raise SystemExit('code was run')")
        archive.writestr("toys/data/cube.blend", "BLENDER")
        archive.writestr("toys/data/../../escaped.urdf", "<robot/>")
        archive.writestr("toys/code.py", "raise SystemExit('code was run')")
    return path


@pytest.fixture
def manifest(wheel: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Manifest:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "home"))
    official = read_manifest(manifest_path("official"))
    assets = official.assets.model_copy(
        update={
            "wheel": "toys==1.0",
            "sha256": hashlib.sha256(wheel.read_bytes()).hexdigest(),
            "folder": "toys/data",
        }
    )
    return official.model_copy(update={"assets": assets})


def files_below(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_only_data_is_unpacked(manifest: Manifest, wheel: Path, tmp_path: Path) -> None:
    folder = install_scene(manifest, wheel)
    assert files_below(folder) == {"cube.urdf", "meshes/cube.obj"}
    assert not list(tmp_path.rglob("escaped.urdf"))


def test_reinstalling_replaces_the_whole_scene(manifest: Manifest, wheel: Path) -> None:
    folder = install_scene(manifest, wheel)
    (folder / "stray.urdf").write_text("")
    assert files_below(install_scene(manifest, wheel)) == {"cube.urdf", "meshes/cube.obj"}


def test_another_wheel_is_refused_and_nothing_is_lost(manifest: Manifest, wheel: Path) -> None:
    folder = install_scene(manifest, wheel)
    with wheel.open("ab") as file:
        file.write(b"x")
    with pytest.raises(SceneError, match="is not the wheel"):
        install_scene(manifest, wheel)
    assert files_below(folder) == {"cube.urdf", "meshes/cube.obj"}


def test_missing_wheel_is_named(manifest: Manifest, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"wheel not found: .*none\.whl"):
        install_scene(manifest, tmp_path / "none.whl")


def test_shipped_scene_needs_no_installation() -> None:
    with pytest.raises(SceneError, match="needs no installation"):
        install_scene(read_manifest(manifest_path("builtin")))


def test_failed_download_names_the_alternative(
    manifest: Manifest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    with pytest.raises(SceneError, match=r"cannot download toys==1\.0.*--from FILE"):
        install_scene(manifest)


def test_folder_that_no_wheel_holds_is_named_and_nothing_is_lost(
    manifest: Manifest, wheel: Path
) -> None:
    folder = install_scene(manifest, wheel)
    wrong = manifest.assets.model_copy(update={"folder": "toys/dta"})
    with pytest.raises(SceneError, match=r"holds no folder toys/dta"):
        install_scene(manifest.model_copy(update={"assets": wrong}), wheel)
    assert files_below(folder) == {"cube.urdf", "meshes/cube.obj"}


def test_installation_that_fails_at_the_last_moment_loses_nothing(tmp_path: Path) -> None:
    (target := tmp_path / "scene").mkdir()
    (target / "cube.urdf").write_text("<robot/>")
    (tmp_path / "new").mkdir()
    with pytest.raises(FileNotFoundError):
        _replace_folder(tmp_path / "new" / "nothing", target)
    assert files_below(target) == {"cube.urdf"}


def test_what_is_no_wheel_is_refused(manifest: Manifest, tmp_path: Path) -> None:
    path = tmp_path / "text.whl"
    path.write_text("text")
    sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
    assets = manifest.assets.model_copy(update={"sha256": sha256})
    with pytest.raises(SceneError, match="cannot install scene official"):
        install_scene(manifest.model_copy(update={"assets": assets}), path)
