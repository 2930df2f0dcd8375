"""What recordings and results keep of the packages and the code that made them."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from real_bench.provenance import package_versions
from real_bench.version import SOURCE


def test_package_versions_are_known() -> None:
    assert {"real-bench", "python", "pybullet", "numpy"} <= package_versions().keys()
    assert "unknown" not in package_versions().values()


def test_our_code_has_one_hash_installed_or_not(tmp_path: Path) -> None:
    """A wheel has in the package what a checkout has beside it."""
    root = Path(__file__).parents[1]
    installed = tmp_path / "real_bench"
    for source, target in (
        (root / "real_bench", installed),
        (root / "controllers", installed / "controllers"),
        (root / "goals", installed / "goals"),
    ):
        shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n"
        "from real_bench import provenance\n"
        "print(provenance.__file__, provenance.package_versions()[provenance.SOURCE])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    file, found = done.stdout.split()
    assert file.startswith(str(tmp_path))
    assert found == package_versions()[SOURCE]
