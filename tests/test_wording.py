"""Errors of the API name arguments, not a command's options."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import real_bench
from real_bench.files.atomic import OutputError
from real_bench.wording import in_python


@pytest.mark.parametrize(
    ("command", "python"),
    [
        (
            "run.h5 exists: use --resume or --overwrite, or another --out",
            "run.h5 exists: use resume=True or overwrite=True, or another out",
        ),
        ("the run has 2: use --objects 1", "the run has 2: use objects=1"),
        (
            "no controller given (try --controller real_r)",
            'no controller given (try controller="real_r")',
        ),
        ("leave out --no-images", "leave out images=False"),
        ("use --keep-learned or --relearn", 'use learned="keep" or learned="again"'),
        ("give its goal set with --run-steps", "give its goal set with run_steps"),
        ("resume it (realbench intrinsic --resume)", "resume it (realbench intrinsic --resume)"),
        ("use `realbench film --actions 1` or --run", "use `realbench film --actions 1` or run"),
    ],
)
def test_options_become_arguments(command: str, python: str) -> None:
    assert in_python(command) == python


@pytest.mark.parametrize("name", ["/data/my--run.h5", "exp--seed 3", "a.--out", "/--out", "---out"])
def test_a_file_s_name_is_no_option(name: str) -> None:
    assert in_python(f"{name} exists: use another --out") == f"{name} exists: use another out"


@given(st.text())
def test_text_without_options_stays(text: str) -> None:
    assert "--" in text or in_python(text) == text


def test_errors_of_the_api_speak_python(tmp_path: Path) -> None:
    (tmp_path / "run.h5").touch()
    play: dict[str, Any] = {"condition": "OM", "scene": "builtin", "out": tmp_path / "run.h5"}
    with pytest.raises(OutputError, match=r"use resume=True or overwrite=True, or another out$"):
        real_bench.run_intrinsic("real_r", **play)
