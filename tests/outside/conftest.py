from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from real_bench import lengths
from real_bench.conditions import Condition
from real_bench.goal_sets import save_goal_set
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.trial import TrialPlan
from real_bench.simulation import Scene
from tests.cli.shell import tiny_goals
from tests.experiments.conftest import TINY
from tests.recording.bench import ignore

SHORT = 200


@pytest.fixture(scope="session")
def material(tmp_path_factory: pytest.TempPathFactory, builtin_scene: Scene) -> Path:
    """A recording, a result, two goals, and an experiment."""
    folder = tmp_path_factory.mktemp("material")
    goals = tiny_goals(builtin_scene)
    save_goal_set(goals, folder / "goals.npy")
    (folder / "tiny.yaml").write_text(yaml.safe_dump(TINY))
    condition = Condition.parse("OM")
    IntrinsicPhase("real_r", condition, 1, builtin_scene, 2000, 0, folder / "run.h5").run(ignore)
    plan = TrialPlan("real_r", condition, builtin_scene, goals, 0, SHORT)
    ExtrinsicPhase(plan, 2, folder / "score.json").run(ignore)
    return folder


@pytest.fixture
def place(material: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The same in a folder of its own, in which everyone may write; commands run there."""
    monkeypatch.setattr(lengths, "TRIAL_STEPS", SHORT)
    folder = Path(tempfile.mkdtemp(prefix="outside-"))
    for file in material.iterdir():
        shutil.copy(file, folder)
    for path in (folder, *folder.iterdir()):
        path.chmod(0o777)
    before = Path.cwd()
    os.chdir(folder)
    yield folder
    os.chdir(before)
    shutil.rmtree(folder)


@pytest.fixture
def full_disk(place: Path) -> Iterator[Path]:
    """A folder on a disk on which nothing more has room."""
    folder = place / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "none", str(folder)]
    if subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("only root may mount a small disk")
    try:
        (folder / "old").write_bytes(b"old")
        with (folder / "junk").open("wb", buffering=0) as junk:
            try:
                while junk.write(bytes(4096)):
                    pass
            except OSError:
                pass
        yield folder
    finally:
        subprocess.run(["umount", "-l", folder], check=True)
