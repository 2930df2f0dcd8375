from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from real_bench.experiments import Spec, read_spec
from real_bench.experiments.plan import ExperimentPlan
from tests.cli.shell import realbench
from tests.scoring.bench import made

TINY: dict[str, Any] = {
    "title": "tiny",
    "results": "results",
    "scene": "builtin",
    "steps": 2000,
    "trial_steps": 500,
    "repeats": 2,
    "goals": {"few": {"seed": 5, "counts": {"2D": 2}}},
    "plays": {"random": {"controller": "real_r", "condition": "OM"}},
    "cells": [
        {
            "controller": "real_r",
            "condition": "OM",
            "play": "random",
            "published": {"mean": 0.021, "standard_error": 0.002, "repeats": 30},
        },
        {"controller": "real_d", "condition": "OM", "play": "random"},
        {"controller": "real_r", "condition": "IJ", "play": "none", "repeats": 1},
    ],
}
"""Two plays that two cells share, and five tests."""

WriteSpec = Callable[..., Path]


def spec_in(folder: Path, **changes: Any) -> Path:
    """The file of the tiny experiment, with some fields changed."""
    path = folder / "tiny.yaml"
    path.write_text(json.dumps({**TINY, **changes}))  # JSON is YAML
    return path


@pytest.fixture
def write_spec(tmp_path: Path) -> WriteSpec:
    """Write the tiny experiment, with some fields changed."""
    return partial(spec_in, tmp_path)


@dataclass(frozen=True)
class Finished:
    """The tiny experiment, run by the real command to its end: for reading only."""

    path: Path
    stdout: str
    stderr: str

    def print(self, *options: str) -> subprocess.CompletedProcess[str]:
        """Its table once more."""
        return realbench(self.path.parent, "table", self.path, *options)

    @property
    def table(self) -> Any:
        """What every other run of it must give."""
        return json.loads(self.print("--json").stdout)


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    folder = tmp_path_factory.mktemp("finished")
    path = spec_in(folder)
    done = realbench(folder, "table", path, "--jobs", "2")
    return Finished(path, done.stdout, done.stderr)


@pytest.fixture
def spec(write_spec: WriteSpec) -> Spec:
    return read_spec(write_spec())


DISTANCES = {0: (0.05, 0.10), 1: (0.15, 0.30)}
"""Of the two goals, by seed of the repeat."""
SAME = (
    *("condition", "objects", "controller", "seed"),
    *("run_steps", "n_goals", "trial_steps", "goals_sha256"),
)
"""What a job and its result say alike."""


@pytest.fixture(scope="session")
def drawn_goals(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the goals that the tiny experiment draws."""
    spec = read_spec(spec_in(tmp_path_factory.mktemp("drawn")))
    spec.results_folder.mkdir()
    list(ExperimentPlan(spec).goals.draw())
    return spec.results_folder


@pytest.fixture
def drawn(spec: Spec, drawn_goals: Path) -> Spec:
    """The tiny experiment with its goals drawn."""
    shutil.copytree(drawn_goals, spec.results_folder)
    return spec


def keep(spec: Spec, cell: int = 0, repeat: int = 0, n_trials: int = 2, **changes: Any) -> Path:
    """Write a result that fits a cell, but for some changes of its setting."""
    job = ExperimentPlan(spec).scorings(spec.cells[cell], repeat)[0]
    told = {name: getattr(job, name) for name in SAME}
    distances = DISTANCES[repeat][:n_trials]
    made(distances, classes=["2D"], **{**told, **changes}).save(job.out)
    return job.out
