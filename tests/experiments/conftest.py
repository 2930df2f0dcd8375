from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from real_bench.experiments import Spec, read_spec

TINY: dict[str, Any] = {
    "title": "tiny",
    "results": "results",
    "scene": "builtin",
    "steps": 3000,
    "trial_steps": 2000,
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


@pytest.fixture
def write_spec(tmp_path: Path) -> WriteSpec:
    """Write the tiny experiment, with some fields changed."""

    def write_spec(**changes: Any) -> Path:
        path = tmp_path / "tiny.yaml"
        path.write_text(json.dumps({**TINY, **changes}))  # JSON is YAML
        return path

    return write_spec


@pytest.fixture
def spec(write_spec: WriteSpec) -> Spec:
    return read_spec(write_spec())
