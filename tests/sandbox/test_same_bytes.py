"""A controller plays the same, to the last bit, wherever it runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import hdf5plugin  # noqa: F401  registers the compression of the images
import numpy as np
import pytest

from real_bench.recording import Recording
from real_bench.sandbox import SandboxBackend, SandboxSupport
from real_bench.scoring.result import Result
from tests.phases.conftest import toy
from tests.sandbox.conftest import LIMITS, Face, Play

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
        (toy("series:StepMacros"), "OM", 1500),
        (toy("series:ManyKindsOfState"), "OM", 3000),
        (toy("tested:GlobalRandomness"), "IJ", 300),
        ("tests.sandbox.controllers:Looks", "OJ", 120),
        ("tests.sandbox.controllers:LooksOfficially", "OJ", 120),
        ("tests.sandbox.controllers:LooksOfficially", "IJ", 120),
        ("tests.sandbox.controllers:Glances", "OM", 3000),
    ],
)
def test_play_is_the_same(
    play: Play, isolated: SandboxBackend, controller: str, condition: str, steps: int
) -> None:
    here = play(controller, steps, condition=condition, out="here.h5")
    there = play(controller, steps, condition=condition, out="there.h5", backend=isolated)
    assert content(here) == content(there)


@pytest.mark.parametrize(("kind", "jobs"), [("Looks", 1), ("Looks", 2), ("LooksOfficially", 1)])
def test_tests_are_the_same(
    face_goals: Face, isolated: SandboxBackend, kind: str, jobs: int
) -> None:
    controller = f"tests.sandbox.controllers:{kind}"
    options: dict[str, Any] = {"condition": "OJ", "trial_steps": 60}
    here = face_goals(controller, out="here", **options)
    there = face_goals(controller, out="there", backend=isolated, jobs=jobs, **options)
    assert scores(here) == scores(there)


@pytest.mark.parametrize("condition", ["OM", "IM"])
def test_learning_from_a_recording_is_the_same(
    play: Play, face_goals: Face, support: SandboxSupport, condition: str
) -> None:
    run = play("real_r", 4000, condition=condition)
    controller = "tests.sandbox.controllers:Remembers"
    backend = SandboxBackend((), LIMITS, support)
    for run_steps in (None, 2000):
        options: dict[str, Any] = {"run": run, "run_steps": run_steps, "condition": condition}
        here = face_goals(controller, out=f"here{run_steps}", **options)
        there = face_goals(controller, out=f"there{run_steps}", backend=backend, **options)
        assert scores(here) == scores(there)
        assert len({trial.actions_sha256 for trial in here.trials}) == 1


def test_resumed_run_is_the_same(play: Play, isolated: SandboxBackend) -> None:
    controller = toy("series:ManyKindsOfState")
    runs = []
    for out, backend in (("here.h5", None), ("there.h5", isolated)):
        play(controller, 2000, out=out, backend=backend)
        runs.append(play(controller, 4000, out=out, backend=backend, resume=True))
    assert content(runs[0]) == content(runs[1])
    with Recording(runs[1]) as recording:
        assert recording.cuts == [2000]
        state = recording.controller_state()
    np.testing.assert_array_equal(state["counter"], 4)
