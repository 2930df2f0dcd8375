"""Scenes: where they are, and their files.

A scene is a manifest, a YAML file. Two ship with the package (``official`` and ``builtin``); a
user's own is named by its path.
"""

from __future__ import annotations

import hashlib
from functools import cached_property
from pathlib import Path

from pydantic import ValidationError

from real_bench.errors import SceneError, faults
from real_bench.inputs.whole import whole
from real_bench.inputs.yaml_files import read_mapping
from real_bench.simulation.manifest import Manifest
from real_bench.text.nearest import did_you_mean, unknown_name_hint

SHIPPED_SCENES = Path(__file__).parent / "scenes"
DEFAULT_SCENE = "official"


class Scene:
    """A manifest together with the folder that holds its files."""

    def __init__(self, manifest: Manifest, folder: Path, source: str) -> None:
        self.manifest = manifest
        self.folder = folder
        self.source = source  # what load_scene takes: a name, or the manifest's path

    @property
    def name(self) -> str:
        """The scene's name, as the manifest gives it."""
        return self.manifest.name

    def path(self, file: str) -> Path:
        """The path of one of the scene's files; raises SceneError if it does not exist."""
        path = self.folder / file
        if not path.resolve().is_relative_to(self.folder.resolve()):
            raise SceneError(f"scene {self.name}: {file} is outside the scene's folder")
        if not path.is_file():
            raise SceneError(f"scene {self.name}: file not found: {path}")
        return path

    def object_names(self, n_objects: int) -> tuple[str, ...]:
        """The names of the first ``n_objects`` objects; raises SceneError for any other number."""
        available = self.manifest.objects
        count = whole(
            n_objects, f"objects of scene {self.name}", 1, len(available), error=SceneError
        )
        return tuple(body.name for body in available[:count])

    @cached_property
    def sha256(self) -> str:
        """A hash of what decides what is simulated and seen: the manifest and its files.

        Where the files come from and how goals are drawn do not count: they change no physics. Nor
        do options left at their defaults, so that a new option does not change old hashes.
        """
        digest = hashlib.sha256()
        decisive = self.manifest.model_dump_json(exclude={"assets", "goals"}, exclude_defaults=True)
        digest.update(decisive.encode())
        for path in sorted(_files_below(self.folder)):
            relative = path.relative_to(self.folder).as_posix()
            content = hashlib.sha256(path.read_bytes()).hexdigest()
            digest.update(f"{relative}\0{content}\n".encode())
        return digest.hexdigest()


def load_scene(name_or_path: str | Path = DEFAULT_SCENE) -> Scene:
    """Find a scene by name (``official``, ``builtin``) or by the path of its manifest.

    Raises:
        SceneError: it is unknown, invalid, or not installed (the message has the remedy).
    """
    path = manifest_path(name_or_path)
    manifest = read_manifest(path)
    if manifest.assets.wheel is None:
        folder = path.parent / manifest.assets.folder
    else:
        folder = installed_folder(manifest)
        if not folder.is_dir():
            which = "" if name_or_path == DEFAULT_SCENE else f" {name_or_path}"
            raise SceneError(
                f"scene {manifest.name} is not installed: run `realbench scene install{which}`, "
                "or use our own scene with `--scene builtin`"
            )
    if not folder.is_dir():
        raise SceneError(f"scene {manifest.name}: folder not found: {folder}")
    shipped = str(name_or_path) in shipped_scenes()
    return Scene(manifest, folder, str(name_or_path) if shipped else str(path.resolve()))


def manifest_path(name_or_path: str | Path) -> Path:
    """The manifest that a scene's name, folder or path means; raises SceneError."""
    shipped = shipped_scenes()
    if str(name_or_path) in shipped:
        return shipped[str(name_or_path)]
    path = Path(name_or_path)
    if path.is_dir():
        path = path / "scene.yaml"
    if path.suffix not in (".yaml", ".yml") or not path.is_file():
        raise SceneError(
            f"unknown scene {str(name_or_path)!r}: use {' or '.join(shipped)}, "
            f"or the path to a manifest (.yaml){did_you_mean(str(name_or_path), shipped)}"
        )
    return path


def read_manifest(path: Path) -> Manifest:
    """Read and check a manifest; raises SceneError with every fault at once."""
    content = read_mapping(path, "the scene", SceneError)
    try:
        return Manifest.model_validate(content)
    except ValidationError as error:
        found = faults(error, unknown=unknown_name_hint(Manifest))
        raise SceneError(f"the scene {path} is not valid: {found}") from error


def shipped_scenes() -> dict[str, Path]:
    """The manifests that ship with the package, by name."""
    single = {path.stem: path for path in SHIPPED_SCENES.glob("*.yaml")}
    folders = {path.parent.name: path for path in SHIPPED_SCENES.glob("*/scene.yaml")}
    return dict(sorted({**single, **folders}.items()))


def installed_folder(manifest: Manifest) -> Path:
    """Where the files of an installed scene lie: in the user's data directory."""
    import platformdirs

    try:
        root = Path(platformdirs.user_data_dir("realbench", appauthor=False))
    except RuntimeError as error:
        raise SceneError(
            f"no folder to install scene {manifest.name} in: set HOME or XDG_DATA_HOME"
        ) from error
    return root / "scenes" / manifest.name


def _files_below(folder: Path) -> list[Path]:
    """The files of a scene: what a body can name, not caches or editor files."""
    wanted = {".urdf", ".obj", ".mtl", ".stl", ".dae", ".png", ".jpg", ".jpeg", ".tga"}
    return [path for path in folder.rglob("*") if path.suffix.lower() in wanted and path.is_file()]
