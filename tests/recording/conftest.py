from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from real_bench.conditions import Condition
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.provenance import package_versions
from real_bench.recording import Header, Recording
from real_bench.simulation import Scene, load_scene
from tests.recording.bench import SCENE, ignore

settings.register_profile("patient", deadline=None)
settings.load_profile("patient")

CUT_AT, CUT_RUN_STEPS = 3500, 6200


@pytest.fixture(scope="session")
def scene() -> Scene:
    return load_scene(SCENE)


@pytest.fixture(scope="session")
def cut_path(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Positions and images of two objects; the run was cut after 3,500 of 6,200 steps."""
    out = tmp_path_factory.mktemp("cut") / "run.h5"
    for steps in (CUT_AT, CUT_RUN_STEPS):
        phase = IntrinsicPhase(
            "real_r", Condition.parse("OM"), 2, scene, steps, seed=3, out=out, images=True
        )
        phase.run(ignore, resume=True)
    return out


@pytest.fixture(scope="session")
def image_path(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Images of 20,000 steps."""
    out = tmp_path_factory.mktemp("images") / "run.h5"
    IntrinsicPhase("real_r", Condition.parse("IM"), 1, scene, 20_000, seed=0, out=out).run(ignore)
    return out


@pytest.fixture
def cut_run(cut_path: Path) -> Iterator[Recording]:
    with Recording(cut_path) as recording:
        yield recording


@pytest.fixture(scope="session")
def header(scene: Scene) -> Header:
    return Header(
        condition="OM",
        control_version=2,
        objects=2,
        object_names=scene.object_names(2),
        scene=scene.name,
        scene_source=scene.source,
        scene_sha256=scene.sha256,
        seed=3,
        controller="real_r",
        controller_source="real_r",
        controller_class="RealR",
        images=True,
        versions=package_versions(),
    )
