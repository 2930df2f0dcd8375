"""Other physics is told from forgery.

A world of slightly other gravity stands in for another build of pybullet, or another processor.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest

from real_bench import physics
from real_bench.conditions import Condition
from real_bench.experiments import Spec
from real_bench.experiments.scores import Row
from real_bench.experiments.table import cells as cells_of
from real_bench.experiments.table import notes
from real_bench.goal_sets import GoalSet
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.trial import TrialPlan
from real_bench.recording import Recording
from real_bench.scoring.metric import object_scores
from real_bench.scoring.result import load_result
from real_bench.simulation import HOME, Scene, Simulation, simulation
from real_bench.verification import RecordingVerification, ResultVerification
from tests.cli.shell import realbench
from tests.recording.bench import ignore
from tests.verification.conftest import forged

OM = Condition.parse("OM")
PUSHER = """
from real_bench.actions import Action
from real_bench.controller import Controller

class Pusher(Controller):
    def next_action(self, observation):
        x, y, _ = observation["object_positions"]["cube"]
        return Action.macro([[x, min(y + 0.2, 0.5)], [x, max(y - 0.2, -0.5)]])
"""
GRAVITY = simulation.GRAVITY
Elsewhere = Callable[[float], None]


@pytest.fixture
def elsewhere(monkeypatch: pytest.MonkeyPatch) -> Iterator[Elsewhere]:
    """Go to where gravity is so much more; 0: come back."""

    def go(more: float) -> None:
        monkeypatch.setattr(simulation, "GRAVITY", (*GRAVITY[:2], GRAVITY[2] * (1 + more)))
        physics.fingerprint.cache_clear()

    yield go
    physics.fingerprint.cache_clear()


def quietly(done: int, total: int) -> None:
    """No progress is shown."""


def result_of(scene: Scene, goals: GoalSet, out: Path, trial_steps: int = 2000) -> Path:
    (out.parent / "pusher.py").write_text(PUSHER)
    plan = TrialPlan(str(out.parent / "pusher.py"), OM, scene, goals, 0, trial_steps)
    ExtrinsicPhase(plan, 2, out).run(ignore)
    return out


def played(scene: Scene, out: Path, steps: int) -> Path:
    (out.parent / "pusher.py").write_text(PUSHER)
    phase = IntrinsicPhase(str(out.parent / "pusher.py"), OM, 1, scene, steps, 0, out)
    phase.run(ignore, resume=True)
    return out


def test_the_fingerprint_is_the_same_whenever_it_is_taken(builtin_scene: Scene) -> None:
    first = physics.fingerprint.__wrapped__()
    with Simulation(builtin_scene, 2) as other:
        other.hold(HOME, 100)
        assert physics.fingerprint.__wrapped__() == first == physics.fingerprint()


def test_fingerprint_changes_with_the_last_bit(elsewhere: Elsewhere) -> None:
    here = physics.fingerprint()
    elsewhere(float(np.finfo(float).eps))
    assert physics.fingerprint() != here


def test_doctor_reports_whether_physics_is_the_reference(tmp_path: Path) -> None:
    facts = json.loads(realbench(tmp_path, "doctor", "--scene", "builtin", "--json").stdout)
    assert facts["physics"] == physics.fingerprint()
    assert facts["physics_is_the_reference"] == (physics.fingerprint() == physics.REFERENCE)
    told = realbench(tmp_path, "doctor", "--scene", "builtin").stdout
    assert ("all is well" in told) == facts["physics_is_the_reference"]
    assert ("different physics than the reference" in told) != facts["physics_is_the_reference"]


def test_recordings_and_results_keep_the_fingerprint(
    builtin_scene: Scene, goals: GoalSet, tmp_path: Path, elsewhere: Elsewhere
) -> None:
    here = physics.fingerprint()
    run = played(builtin_scene, tmp_path / "run.h5", 1000)
    elsewhere(1e-3)
    played(builtin_scene, run, 2000)
    with Recording(run) as recording:
        assert [part["physics"] for part in recording.parts] == [here, physics.fingerprint()]
    setting = load_result(result_of(builtin_scene, goals, tmp_path / "score.json")).setting
    assert setting.versions["physics"] == physics.fingerprint() != here


def test_a_result_of_other_physics_is_not_called_forged(
    builtin_scene: Scene, goals: GoalSet, goals_path: Path, tmp_path: Path, elsewhere: Elsewhere
) -> None:
    elsewhere(0.05)
    there = physics.fingerprint()
    path = result_of(builtin_scene, goals, tmp_path / "score.json")
    elsewhere(0)
    verdict = ResultVerification(path, goals_path).verify(quietly)
    assert not verdict.holds
    assert verdict.is_undecided
    told = verdict.lines()[-1]
    assert told.startswith("cannot be judged here, physics differs: ")
    assert f"verify it where physics is {there}" in told
    done = realbench(tmp_path, "verify", path, "--goals", goals_path, "--json", code=5)
    found = json.loads(done.stdout)
    assert found["undecided"]
    assert found["physics"] == {"then": there, "here": physics.fingerprint()}


def test_result_of_other_physics_can_verify_to_a_millimetre(
    builtin_scene: Scene, goals: GoalSet, goals_path: Path, tmp_path: Path, elsewhere: Elsewhere
) -> None:
    elsewhere(1e-9)
    path = result_of(builtin_scene, goals, tmp_path / "score.json", 300)  # nothing is pushed yet
    elsewhere(0)
    verdict = ResultVerification(path, goals_path).verify(quietly)
    assert verdict.holds
    assert verdict.lines()[-1].startswith("verified: 2 of 2 trials agree within 1 mm")
    assert any("bits cannot agree" in note for note in verdict.notes)


def test_other_physics_excuses_no_forgery(
    builtin_scene: Scene, goals: GoalSet, goals_path: Path, tmp_path: Path, elsewhere: Elsewhere
) -> None:
    """A score follows from the poses that are recorded, wherever these were made."""
    elsewhere(1e-3)
    path = result_of(builtin_scene, goals, tmp_path / "score.json")
    elsewhere(0)
    result = load_result(path)
    nearer = 0.9 * np.array(result.trials[1].distances)
    better = {"distances": tuple(nearer.tolist()), "score": float(object_scores(nearer).sum())}
    trials = (result.trials[0], result.trials[1].model_copy(update=better))
    told = result.model_copy(update={"trials": trials}).to_json()
    verdict = ResultVerification(forged(path, told), goals_path).verify(quietly)
    assert not verdict.holds
    assert not verdict.is_undecided
    assert "first goal 1" in verdict.lines()[-1]


def test_a_recording_of_other_physics_is_not_called_forged(
    builtin_scene: Scene, tmp_path: Path, elsewhere: Elsewhere
) -> None:
    """Of three parts the second was played elsewhere."""
    run = tmp_path / "run.h5"
    for more, steps in ((0, 1000), (0.05, 3000), (0, 4000)):
        elsewhere(more)
        played(builtin_scene, run, steps)
    verdict = RecordingVerification(run).verify(quietly)
    assert verdict.is_undecided
    assert 1 <= verdict.n_actions < 4
    assert verdict.lines()[-1].startswith("cannot be judged here, physics differs: ")
    realbench(tmp_path, "verify", run, code=5)


def test_recording_without_a_fingerprint_is_judged_by_bits(
    builtin_scene: Scene, tmp_path: Path
) -> None:
    run = played(builtin_scene, tmp_path / "run.h5", 2000)
    with h5py.File(run, "r+") as file:
        versions = json.loads(file.attrs["versions"])
        del versions["physics"]
        file.attrs["versions"] = json.dumps(versions)
    verdict = RecordingVerification(run).verify(quietly)
    assert verdict.holds
    assert any("its physics is unknown" in note for note in verdict.notes)


def test_compare_marks_results_of_mixed_physics(
    builtin_scene: Scene, goals: GoalSet, tmp_path: Path, elsewhere: Elsewhere
) -> None:
    here = physics.fingerprint()
    one = result_of(builtin_scene, goals, tmp_path / "one.json", 300)
    elsewhere(1e-3)
    other = result_of(builtin_scene, goals, tmp_path / "other.json", 300)
    alike = load_result(one)
    again = alike.setting.model_copy(update={"seed": 9})
    alike.model_copy(update={"setting": again}).save(tmp_path / "again.json")
    mixed = realbench(tmp_path, "compare", one, other).stdout
    assert "results with different physics are mixed" in mixed
    assert here in mixed
    assert "physics" not in realbench(tmp_path, "compare", one, "again.json").stdout
    found = json.loads(realbench(tmp_path, "compare", one, other, "--json").stdout)
    assert found["physics"] == sorted([here, physics.fingerprint()])


def test_a_table_marks_rows_that_mix_physics() -> None:
    cells = [{"controller": "real_r", "condition": letters} for letters in ("OM", "IM")]
    known = {"folder": Path(), "title": "x", "results": Path("r"), "cells": cells}
    spec = Spec.model_validate(known)
    kinds = [("a" * 16, "b" * 16), ("a" * 16, "a" * 16)]
    rows = [
        Row(cell, 2, (0, 1), (), control_version=None, summary=None, physics=each)
        for cell, each in zip(spec.cells, kinds, strict=True)
    ]
    assert [cells_of(row)[3] for row in rows] == ["2 of 2‡", "2 of 2"]
    told = f"‡ results with different physics are mixed (3 of {'a' * 16}, 1 of {'b' * 16})"
    assert any(note.startswith(told) for note in notes(spec, rows))
    assert not any("physics" in note for note in notes(spec, rows[1:]))
    assert rows[0].to_json()["physics"] == ["a" * 16, "b" * 16]


def test_a_table_of_unlike_rows_says_so_without_a_mark(tmp_path: Path) -> None:
    cells = [{"controller": "real_r", "condition": letters} for letters in ("OM", "IM")]
    spec = Spec.model_validate(
        {"folder": tmp_path, "title": "x", "results": Path("r"), "cells": cells}
    )
    rows = [
        Row(cell, 1, (0,), (), control_version=None, summary=None, physics=(each * 16,))
        for cell, each in zip(spec.cells, "ab", strict=True)
    ]
    (told,) = [note for note in notes(spec, rows) if "physics" in note]
    assert told.startswith("results with different physics are mixed")


def test_physics_that_no_one_recorded_may_be_the_same() -> None:
    unknown = physics.physics_of({})
    assert not physics.mixture([unknown, unknown])
    told = physics.mixture(["a" * 16, unknown])
    assert told.startswith("results with different physics may be mixed")
    assert "are mixed" in physics.mixture(["a" * 16, "b" * 16, unknown])
