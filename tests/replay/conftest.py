from __future__ import annotations

from pathlib import Path

import pytest

from real_bench.conditions import Condition
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.simulation import Scene
from tests.recording.bench import ignore


@pytest.fixture(scope="session")
def recorded(builtin_scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five actions with images of two objects, cut after the second; the last one is short."""
    out = tmp_path_factory.mktemp("recorded") / "run.h5"
    for steps in (2000, 4500):
        phase = IntrinsicPhase(
            "real_r", Condition.parse("OM"), 2, builtin_scene, steps, 3, out, images=True
        )
        phase.run(ignore, resume=True)
    return out
