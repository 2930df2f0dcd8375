from __future__ import annotations

from pathlib import Path

import pytest

from real_bench.figures import FigureData
from tests.figures.bench import FEW_STEPS, REST, Test, made_up, read, record, reread


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings: two that were pushed, one that has learned to see, and odd ones."""
    folder = tmp_path_factory.mktemp("recordings")
    record(folder / "pushed.h5", images=True)
    record(folder / "learned.h5", "real_ld", "IM", steps=4000, seed=2, **FEW_STEPS)
    record(folder / "one.h5", steps=1000, images=True)
    record(folder / "still.h5", REST, steps=2000, images=True)
    for steps in (1500, 2600):
        record(folder / "two.h5", "real_r", steps=steps, objects=2, images=False, resume=True)
    return folder


@pytest.fixture(scope="session")
def material(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> FigureData:
    """All of these, and results of three tests, one of them repeated, one after less play."""
    results = (
        made_up(Test(), [0.0, 0.05, 0.1, 0.2]),
        made_up(Test(run="6" * 64), [0.1, 0.1, 0.1, 0.1]),
        made_up(Test(condition="IJ"), [0.2, 0.0, 0.3, 0.05]),
        made_up(Test("real_d", "OM"), [0.0, 0.0, 0.0, 0.0]),
        made_up(Test(run_steps=1_000_000), [0.2, 0.2, 0.4, 0.4]),
    )
    paths = [folder / f"{name}.h5" for name in ("pushed", "learned", "one", "still", "two")]
    return FigureData(read(*paths), reread(tmp_path_factory.mktemp("results"), *results))
