"""What can change what a run does: packages, our own code, and the physics of this machine."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from real_bench.controller_code.source import module_location
from real_bench.physics import PHYSICS, fingerprint
from real_bench.version import SOURCE, __version__

PACKAGES = (
    "pybullet",
    "numpy",
    "h5py",
    "hdf5plugin",
    "gymnasium",
    "scipy",
    "pillow",
    "opencv-python-headless",
    "torch",
)


def run_versions() -> dict[str, str]:
    """All that can change what a run does: packages, and the fingerprint of physics."""
    return {**package_versions(), PHYSICS: fingerprint()}


def package_versions() -> dict[str, str]:
    """The versions that can change what a run does."""
    versions = {
        "real-bench": __version__,
        SOURCE: _package_sha256()[:16],
        "python": platform.python_version(),
    }
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:  # pragma: no cover  a dependency that is always there
            versions[package] = "unknown"
    return versions


@cache
def _package_sha256() -> str:
    """The hash of our own code, which changes more often than its version.

    The same for the same code, whether it is installed, or a checkout with folders of its own for
    what lies in the package once it is installed.
    """
    package = Path(__file__).parent
    files = {str(file.relative_to(package)): file for file in package.rglob("*.py")}
    for name in ("controllers", "goals"):
        if place := module_location(f"real_bench.{name}"):
            files |= {f"{name}/{file.relative_to(place)}": file for file in place.rglob("*.py")}
    digest = hashlib.sha256()
    for name in sorted(files, key=Path):
        digest.update(name.encode() + b"\0" + files[name].read_bytes())
    return digest.hexdigest()
