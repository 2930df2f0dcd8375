from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from real_bench.controllers.real_ild import RealILD
from real_bench.controllers.real_ld import RealLD

from real_bench.conditions import Condition
from real_bench.errors import RealBenchError
from real_bench.goal_sets import GoalSet, generate_goal_set
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.trial import TrialPlan
from real_bench.real_x.background import Background
from real_bench.real_x.foreground import ForegroundSettings
from real_bench.real_x.latents import Latents, VAESettings
from real_bench.recording import Experience, Recording
from real_bench.scoring.result import TrialResult, load_result
from real_bench.settings import read_settings
from real_bench.simulation import Scene
from tests.recording.bench import ignore

IM = Condition.parse("IM")
PAPER = Path(__file__).parents[2] / "evaluation" / "paper-vae.yaml"
SMALL = {
    "eye": {"width": 40, "height": 30, "shrink": 1, "blur": 2},
    "vae": {"hidden": 16, "steps": 2},
}


@pytest.fixture(scope="module")
def goals(builtin_scene: Scene) -> GoalSet:
    return generate_goal_set(builtin_scene, 1, seed=5, counts={"2D": 1})


def play(scene: Scene, controller: str, out: Path, steps: int = 8000) -> Path:
    settings = SMALL if controller == "real_ld" else {}
    phase = IntrinsicPhase(controller, IM, 1, scene, steps, 2, out, settings=settings)
    phase.run(ignore, resume=True)
    return out


@pytest.fixture(scope="module")
def run(builtin_scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return play(builtin_scene, "real_ld", tmp_path_factory.mktemp("run") / "run.h5")


def face(
    scene: Scene, goals: GoalSet, run: Path, out: Path, run_steps: int | None = None
) -> tuple[TrialResult, ...]:
    plan = TrialPlan("real_ld", IM, scene, goals, 2, 2000, run, run_steps, settings=SMALL)
    return ExtrinsicPhase(plan, 1, out).run(ignore).trials


def test_weights_learned_in_play_are_kept_and_used_in_tests(
    builtin_scene: Scene, goals: GoalSet, run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Recording(run) as recording:
        weights = recording.controller_state()["perception"]["vae"]
    assert weights["mean.bias"].shape == (7,)
    monkeypatch.setattr(Latents, "learn", lambda *_: pytest.fail("it learned again"))
    face(builtin_scene, goals, run, tmp_path / "score.json")


def test_same_is_learned_from_the_recording_of_another_controller(
    builtin_scene: Scene, goals: GoalSet, run: Path, tmp_path: Path
) -> None:
    other = play(builtin_scene, "real_r", tmp_path / "r.h5")
    assert face(builtin_scene, goals, other, tmp_path / "other.json") == face(
        builtin_scene, goals, run, tmp_path / "own.json"
    )


def test_run_steps_learns_as_from_a_shorter_recording(
    builtin_scene: Scene, goals: GoalSet, run: Path, tmp_path: Path
) -> None:
    short = play(builtin_scene, "real_r", tmp_path / "short.h5", 4000)
    part = face(builtin_scene, goals, run, tmp_path / "part.json", run_steps=4000)
    assert part == face(builtin_scene, goals, short, tmp_path / "short.json")
    assert load_result(tmp_path / "part.json").setting.run_steps == 4000
    with pytest.raises(RealBenchError, match="has 8,000 steps, 8,001 were asked for"):
        face(builtin_scene, goals, run, tmp_path / "more.json", run_steps=8001)


def test_resumed_play_learns_again_at_its_end(builtin_scene: Scene, tmp_path: Path) -> None:
    out = tmp_path / "cut.h5"
    states = []
    for steps in (3000, 5000):
        play(builtin_scene, "real_ld", out, steps)
        with Recording(out) as recording:
            states.append(recording.controller_state()["perception"]["vae"]["inward.weight"])
    assert not np.array_equal(*states)


def test_codes_of_triplets_match_those_of_their_images(run: Path) -> None:
    sees = Latents(ForegroundSettings(**SMALL["eye"]), VAESettings(**SMALL["vae"]))
    with pytest.raises(RealBenchError, match="background"):
        sees.state({"retina": np.zeros((240, 320, 3), np.uint8)})
    triplets = sees.triplets(Experience(run, IM))
    with Recording(run) as recording:
        rows, images = recording.transitions, recording.images()
    for state, outcome, row in zip(triplets.states, triplets.outcomes, rows, strict=True):
        before, after = images[row["precondition"]], images[row["outcome"]]
        np.testing.assert_allclose(sees.state({"retina": before}), state, rtol=1e-5, atol=1e-6)
        np.testing.assert_allclose(sees.goal({"goal": after}), outcome, rtol=1e-5, atol=1e-6)


def test_copy_sees_the_same(run: Path, builtin_scene: Scene) -> None:
    from real_bench.spaces import action_space, observation_space

    spaces = action_space(builtin_scene, IM), observation_space(builtin_scene, IM, 1)
    controller = RealLD(*spaces, RealLD.Settings(**SMALL))
    controller.use_experience(Experience(run, IM))
    image = np.random.default_rng(0).integers(0, 255, (240, 320, 3)).astype(np.uint8)
    seen = {"retina": image, "goal": image}
    twin = copy.deepcopy(controller)
    np.testing.assert_array_equal(twin._perception.state(seen), controller._perception.state(seen))


def scenery(n: int = 60) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """A square that jumps about before a still background, and where it is."""
    random = np.random.default_rng(0)
    images = np.repeat(random.integers(0, 120, (1, 30, 40, 3)), n, axis=0).astype(np.uint8)
    where = np.zeros((n, 30, 40), bool)
    for image, mask in zip(images, where, strict=True):
        row, column = random.integers(0, (24, 34))
        mask[row : row + 6, column : column + 6] = True
        image[mask] = 250
    return images, where


def test_foreground_is_what_moves_in_whatever_order() -> None:
    images, where = scenery()
    background = Background(images)
    found = np.array([background.foreground(image) for image in images])
    agree = (found > 0) == where
    assert agree[10:].mean() > 0.995
    again = np.array([background.foreground(image) for image in images[::-1]])[::-1]
    np.testing.assert_array_equal(again, found)


def test_background_needs_two_images() -> None:
    with pytest.raises(RealBenchError, match="needs at least 2 images, not 1"):
        Background(scenery(1)[0])


def test_settings_of_the_paper_are_accepted(builtin_scene: Scene, tmp_path: Path) -> None:
    assert RealILD.Settings.model_validate(read_settings(PAPER, [])).vae.hidden == 512
    paper = read_settings(PAPER, ["vae.steps=1", "vae.hidden=8"])
    phase = IntrinsicPhase(
        "real_ild", IM, 1, builtin_scene, 2000, 0, tmp_path / "run.h5", None, paper
    )
    phase.run(ignore)
    with Recording(tmp_path / "run.h5") as recording:
        learned = recording.controller_state()["perception"]["vae"]
    assert learned["inward.weight"].shape == (8, 320 * 240)
