from __future__ import annotations

from pathlib import Path

import pytest

from real_bench.goal_sets import generate_goal_set, save_goal_set
from real_bench.sandbox import sandbox_support
from real_bench.simulation import Scene


@pytest.fixture(autouse=True)
def _isolated() -> None:
    """A round is held with isolation, or not at all."""
    if not sandbox_support().keep_files:
        pytest.skip("neither bubblewrap nor Landlock works here")


@pytest.fixture(scope="session")
def goals_file(builtin_scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("goals") / "goals.npy"
    save_goal_set(generate_goal_set(builtin_scene, 1, seed=5, counts={"2D": 2, "2.5D": 1}), path)
    return path


@pytest.fixture
def place(tmp_path: Path, goals_file: Path) -> Path:
    """A folder with the goals of a round."""
    (tmp_path / "goals.npy").write_bytes(goals_file.read_bytes())
    return tmp_path
