"""Where an error came from: the helper that failed, and with --traceback all that led there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.cli.shell import realbench, write_controller

PLAY = ("intrinsic", "--scene", "builtin", "--condition", "OM", "--steps", "2000")
HELPER = "def half(value):\n    return value / 0\n"


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A controller whose helper fails, beside it and in another folder."""
    other = tmp_path / "library"
    other.mkdir()
    (other / "faraway.py").write_text(HELPER)
    for name in ("beside", "faraway"):
        folder = tmp_path / name
        folder.mkdir()
        before = f"import sys; sys.path.insert(0, {str(other)!r}); import {name}"
        body = ("def next_action(self, observation):", f"    return {name}.half(1)")
        write_controller(folder / "mine.py", *body, before=before)
    (tmp_path / "beside" / "beside.py").write_text(HELPER)
    return tmp_path


@pytest.mark.parametrize("isolation", ["--no-isolate", "--isolate"])
def test_failing_helper_beside_the_controller_is_named(place: Path, isolation: str) -> None:
    told = realbench(place, *PLAY, "--controller", "beside/mine.py", isolation, code=4).stderr
    assert "beside/beside.py, line 2: ZeroDivisionError" in told
    assert "Traceback" not in told


def test_failing_helper_elsewhere_is_named_with_its_caller(place: Path) -> None:
    told = realbench(place, *PLAY, "--controller", "faraway/mine.py", code=4).stderr
    last = told.splitlines()[-1]
    assert "faraway/mine.py, line 5: ZeroDivisionError: division by zero" in last
    assert f"(raised at {place}/library/faraway.py, line 2)" in last


@pytest.mark.parametrize("isolation", ["--no-isolate", "--isolate"])
def test_traceback_shows_every_frame_of_an_error(place: Path, isolation: str) -> None:
    play = (*PLAY, "--controller", "beside/mine.py", isolation, "--traceback")
    lines = realbench(place, *play, code=4).stderr.splitlines()
    assert any("beside/mine.py" in line and "line 5" in line for line in lines)
    assert any("beside/beside.py" in line and "line 2" in line for line in lines)
    assert lines[-1].startswith("realbench: error: controller beside/mine.py: next_action() failed")


def test_traceback_shows_an_error_in_another_process(place: Path) -> None:
    realbench(place, *PLAY, "--controller", "real_r")
    test = ("extrinsic", "--controller", "beside/mine.py", "--jobs", "2", "--trials", "2")
    realbench(
        place, "goals", "generate", "--scene", "builtin", "--2d", "2", "--25d", "0", "--3d", "0"
    )
    told = realbench(place, *test, "--goals", "goals.npy", "--traceback", code=4).stderr
    assert 'beside/beside.py", line 2' in told
    last = told.splitlines()[-1]
    assert re.match(r"realbench: error: goal \d: controller beside/mine.py: next_action", last)


def test_errors_outside_controllers_have_a_traceback_on_request(place: Path) -> None:
    wrong = ("inspect", "none.h5")
    assert "Traceback" not in realbench(place, *wrong, code=1).stderr
    assert "Traceback" in realbench(place, *wrong, "--traceback", code=1).stderr
