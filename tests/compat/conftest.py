"""Scripts of authors, run in processes of their own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Ran = subprocess.CompletedProcess[str]
RunScript = Callable[..., Ran]


def run_python(folder: Path, *arguments: str, path: Path | None = None) -> Ran:
    """Python in a folder, with another folder first on its path."""
    environment = {**os.environ, "PYTHONPATH": str(path or ""), "DISPLAY": ""}
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )


@pytest.fixture
def run_script(tmp_path: Path) -> RunScript:
    """Run a script in a folder of its own."""

    def run_script(text: str, *, path: Path | None = None) -> Ran:
        (tmp_path / "script.py").write_text(text)
        return run_python(tmp_path, "script.py", path=path)

    return run_script
