"""A controller plays the same, to the last bit, wherever it runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import hdf5plugin  # noqa: F401  registers the compression of the images
import numpy as np
import pytest

from real_bench.isolation import IsolatedHost, Walls
from real_bench.recording import Recording
from real_bench.scoring.result import Result
from tests.isolation.conftest import LIMITS, Face, Play
from tests.phases.conftest import guest

RESULT_TIMING = {"seconds"}


def content(path: Path) -> dict[str, Any]:
    """All that a recording holds."""
    found: dict[str, Any] = {}

    def keep(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            found[name] = item[()].tobytes()

    with h5py.File(path) as file:
        file.visititems(keep)
        return found | {name: str(value) for name, value in file.attrs.items()}


def scores(result: Result) -> dict[str, Any]:
    return result.model_dump(exclude=RESULT_TIMING)


@pytest.mark.parametrize(
    ("controller", "condition", "steps"),
    [
        ("real_r", "IM", 3000),
        (guest("series:StepMacros"), "OM", 1500),
        (guest("series:ManyKindsOfState"), "OM", 3000),
        (guest("tested:GlobalRandomness"), "IJ", 300),
        ("tests.isolation.guests:Looks", "OJ", 120),
        ("tests.isolation.guests:LooksOfficially", "OJ", 120),
        ("tests.isolation.guests:LooksOfficially", "IJ", 120),
        ("tests.isolation.guests:Glances", "OM", 3000),
    ],
)
def test_free_play_is_the_same(
    play: Play, isolated: IsolatedHost, controller: str, condition: str, steps: int
) -> None:
    here = play(controller, steps, condition=condition, out="here.h5")
    there = play(controller, steps, condition=condition, out="there.h5", host=isolated)
    assert content(here) == content(there)


@pytest.mark.parametrize(("kind", "jobs"), [("Looks", 1), ("Looks", 2), ("LooksOfficially", 1)])
def test_tests_are_the_same(face_goals: Face, isolated: IsolatedHost, kind: str, jobs: int) -> None:
    controller = f"tests.isolation.guests:{kind}"
    options: dict[str, Any] = {"condition": "OJ", "trial_steps": 60}
    here = face_goals(controller, out="here", **options)
    there = face_goals(controller, out="there", host=isolated, jobs=jobs, **options)
    assert scores(here) == scores(there)


@pytest.mark.parametrize("run_steps", [None, 2000])
@pytest.mark.parametrize("condition", ["OM", "IM"])
def test_what_was_learned_is_the_same(
    play: Play, face_goals: Face, walls: Walls, condition: str, run_steps: int | None
) -> None:
    run = play("real_r", 4000, condition=condition)
    controller = "tests.isolation.guests:Remembers"
    options: dict[str, Any] = {"run": run, "run_steps": run_steps, "condition": condition}
    here = face_goals(controller, out="here", **options)
    there = face_goals(controller, out="there", host=IsolatedHost((), LIMITS, walls), **options)
    assert scores(here) == scores(there)
    assert len({trial.actions_sha256 for trial in here.trials}) == 1


def test_a_cut_run_goes_on_the_same(play: Play, isolated: IsolatedHost) -> None:
    controller = guest("series:ManyKindsOfState")
    runs = []
    for out, host in (("here.h5", None), ("there.h5", isolated)):
        play(controller, 2000, out=out, host=host)
        runs.append(play(controller, 4000, out=out, host=host, resume=True))
    assert content(runs[0]) == content(runs[1])
    with Recording(runs[1]) as recording:
        assert recording.cuts == [2000]
        state = recording.controller_state()
    np.testing.assert_array_equal(state["counter"], 4)
