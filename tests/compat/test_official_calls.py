"""What official controllers and scripts meet here, line by line beside the official package.

The facts of the official package are in ``tests/data/official_calls.json``; ours are told by the
same script, ``evaluation/official_calls.py``. Every line is as there, or otherwise on purpose.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from real_bench.simulation import Scene
from tests.compat.conftest import run_python

ROOT = Path(__file__).parents[2]
OFFICIAL = json.loads((ROOT / "tests" / "data" / "official_calls.json").read_text())
RUN = """
import runpy, sys
import real_bench.compat
real_bench.compat.install()
script, *sys.argv[1:] = sys.argv[1:]
runpy.run_path(script, run_name="__main__")
"""
LINES = [(section, line) for section, lines in OFFICIAL.items() for line in lines]

NAMES_WHAT_IS_WRONG = "we say what is wrong with an action, in one kind of error"
OTHERWISE = {
    # what line: what is ours, and why it is not the official fact
    "actions/*/without the command": ("error ActionError", NAMES_WHAT_IS_WRONG),
    "actions/*/empty": ("error ActionError", NAMES_WHAT_IS_WRONG),
    "actions/*/NaN": ("error ActionError", NAMES_WHAT_IS_WRONG),
    "actions/*/no dict": ("error ActionError", NAMES_WHAT_IS_WRONG),
    "actions/*/too many numbers": ("error ActionError", "there, poses of 14 numbers are taken"),
    "actions/*/without render": ("as asked", "render is false where it is not given"),
    "actions/joints/a list": ("as asked", "a list of numbers will do, as with other commands"),
}
SCORES = ("/result", "/scores", "/by_class", "/evaluateGoal")
ROUNDING = 1e-15  # distances are summed without BLAS here, whose rounding depends on the processor


@pytest.fixture(scope="session")
def ours(official_scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The same facts of our own module."""
    folder = tmp_path_factory.mktemp("calls")
    script = str(ROOT / "evaluation" / "official_calls.py")
    ran = run_python(folder, "-c", RUN, script, "ours.json")
    assert ran.returncode == 0, ran.stderr
    facts: dict[str, Any] = json.loads((folder / "ours.json").read_text())
    assert facts.keys() == OFFICIAL.keys()
    return facts


@pytest.mark.parametrize(("section", "line"), LINES)
def test_every_line_matches_or_differs_on_purpose(
    ours: dict[str, Any], section: str, line: str
) -> None:
    place = f"{section}/{line}"
    official, own = OFFICIAL[section][line], ours[section][line]
    differing = list(differences(official, own, place))
    expected = [path for path in all_paths(official, place) if pattern(path) in OTHERWISE]
    assert [path for path, _ in differing] == expected
    for path, value in differing:
        wanted, _ = OTHERWISE[pattern(path)]
        assert value == (own["as asked"] if wanted == "as asked" else wanted)


def test_no_recorded_line_is_missing(ours: dict[str, Any]) -> None:
    assert {(section, line) for section, lines in ours.items() for line in lines} == set(LINES)


def pattern(path: str) -> str:
    """The line of OTHERWISE that a path falls under, if it is there."""
    section, _, rest = path.partition("/")
    anywhere = f"{section}/*/{rest.partition('/')[2]}"
    return anywhere if anywhere in OTHERWISE else path


def all_paths(facts: Any, path: str) -> list[str]:
    """The paths of the named facts at the top of a line, whose values may be anything."""
    return [f"{path}/{name}" for name in facts] if isinstance(facts, dict) else [path]


def differences(official: Any, own: Any, path: str) -> Iterator[tuple[str, Any]]:
    """Where two facts differ, and what is ours there."""
    if isinstance(official, dict) and isinstance(own, dict) and official.keys() == own.keys():
        for name, fact in official.items():
            yield from differences(fact, own[name], f"{path}/{name}")
    elif not equal(official, own, path):
        yield path, own


def equal(official: Any, own: Any, path: str) -> bool:
    """Whether two facts are the same: to the last bit, but for scores."""
    if isinstance(official, list) and isinstance(own, list):
        pairs = zip(official, own, strict=False)
        return len(official) == len(own) and all(equal(a, b, path) for a, b in pairs)
    if isinstance(official, dict) and isinstance(own, dict):
        return not list(differences(official, own, path))
    if isinstance(official, bool) is not isinstance(own, bool):
        return False
    if isinstance(official, float) and math.isnan(official):
        return math.isnan(own)
    if isinstance(official, float) and any(name in path for name in SCORES):
        return math.isclose(official, own, rel_tol=ROUNDING)
    return bool(official == own)
