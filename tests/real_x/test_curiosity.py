from __future__ import annotations

from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from real_bench.actions import Action
from real_bench.conditions import Condition
from real_bench.goal_sets import generate_goal_set
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.trial import TrialPlan
from real_bench.real_x.curiosity import Curiosity, CuriositySettings
from real_bench.real_x.explorer import RandomExplorer
from real_bench.recording import Experience, Recording
from real_bench.simulation import Scene
from tests.recording.bench import SCENE, ignore, realbench, recorded_steps, run, start

IM, IJ = Condition.parse("IM"), Condition.parse("IJ")
VAE = {"hidden": 64, "steps": 150}
EYE = {"width": 40, "height": 30, "shrink": 1, "blur": 2.0}
CURIOSITY = {"every": 4, "candidates": 8, "eye": EYE, "vae": VAE, "steps": 100}
SMALL = {"vae": VAE, "eye": EYE, "curiosity": CURIOSITY}
HOME = np.zeros(9)


def play(scene: Scene, condition: Condition, out: Path, steps: int, **options: Any) -> Path:
    settings = {**SMALL, **options}
    phase = IntrinsicPhase("real_ild", condition, 1, scene, steps, 2, out, settings=settings)
    phase.run(ignore, resume=True)
    return out


def rows(path: Path) -> NDArray[Any]:
    with Recording(path) as recording:
        return recording.commands()


@pytest.mark.parametrize("condition", [IM, IJ])
def test_the_same_seed_gives_the_same_play(
    builtin_scene: Scene, tmp_path: Path, condition: Condition
) -> None:
    first = play(builtin_scene, condition, tmp_path / "1.h5", 11_500)
    second = play(builtin_scene, condition, tmp_path / "2.h5", 11_500)
    np.testing.assert_array_equal(rows(first), rows(second))
    with Recording(first) as one, Recording(second) as two:
        np.testing.assert_array_equal(one.object_poses, two.object_poses)
        learned = [run.controller_state()["perception"]["vae"] for run in (one, two)]
    assert {name: values.tolist() for name, values in learned[0].items()} == {
        name: values.tolist() for name, values in learned[1].items()
    }


def test_run_killed_while_learning_is_resumed(tmp_path: Path) -> None:
    short = (
        "curiosity.every=4",
        "curiosity.steps=100",
        "curiosity.vae.steps=1000",
        "curiosity.candidates=8",
    )
    command = realbench(
        *("intrinsic", "--controller", "real_ild", "--condition", "IM", "--scene", SCENE),
        *("--resume", "--steps", 9000, "--set", "vae.steps=10"),
        *(word for setting in short for word in ("--set", setting)),
        eager=True,
    )
    out = tmp_path / "run.h5"
    process = start(command, tmp_path)
    assert process.stderr is not None
    assert any("learning what 4 actions changed" in line for line in process.stderr)
    process.kill()
    process.communicate()
    begun, before = recorded_steps(out), rows(out)
    assert begun <= 4000
    finished = run(command, tmp_path)
    assert finished.returncode == 0, finished.stderr
    assert "learning what 8 actions changed" in finished.stderr
    assert recorded_steps(out) == 9000
    np.testing.assert_array_equal(rows(out)[: len(before)], before)


def test_resumed_run_chooses_like_an_uninterrupted_one(
    builtin_scene: Scene, tmp_path: Path
) -> None:
    """Its choices in the same state are those of the run that was never cut."""
    path = play(builtin_scene, IM, tmp_path / "run.h5", 6000)
    experience = Experience(path, IM)
    random = np.random.default_rng(0)
    proposed = [Action.macro(random.uniform(-0.2, 0.0, (2, 2))) for _ in range(20)]
    lived, recalls = (curiosity() for _ in range(2))
    with Recording(path) as recording:
        states, images = recording.states, recording.images()
    actions = [experience.action(i) for i in range(len(experience))]
    for joints, image, action in zip(
        states["joint_positions"], images, [*actions, None], strict=True
    ):
        seen = {"retina": image, "joint_positions": joints}
        if action is None:
            expected = lived.choose(seen, iter(proposed).__next__)
        else:
            lived.choose(seen, repeat(action).__next__)
    recalls.recall(experience)
    chosen = recalls.choose(seen, iter(proposed).__next__)
    np.testing.assert_array_equal(chosen.commands, expected.commands)


@pytest.mark.parametrize("steps", [500, 3000])
def test_play_shorter_than_the_bootstrap_is_random_and_can_be_tested(
    builtin_scene: Scene, tmp_path: Path, steps: int
) -> None:
    """3000 steps are less than 4 actions, after which it would learn."""
    path = play(builtin_scene, IM, tmp_path / "run.h5", steps)
    phase = IntrinsicPhase("real_r", IM, 1, builtin_scene, steps, 2, tmp_path / "r.h5")
    phase.run(ignore)
    np.testing.assert_array_equal(rows(path), rows(tmp_path / "r.h5"))
    check_it_can_be_tested(builtin_scene, path, tmp_path)


@pytest.mark.parametrize("condition", [IM, IJ])
def test_play_without_any_motion_ends_and_can_be_tested(
    builtin_scene: Scene, tmp_path: Path, condition: Condition, monkeypatch: pytest.MonkeyPatch
) -> None:
    rest = Action.rest(4 if condition is IM else 9)
    monkeypatch.setattr(RandomExplorer, "next_action", lambda explorer: rest)
    path = play(builtin_scene, condition, tmp_path / "run.h5", 6000)
    check_it_can_be_tested(builtin_scene, path, tmp_path)


def check_it_can_be_tested(scene: Scene, path: Path, folder: Path) -> None:
    with Recording(path) as recording:
        assert recording.ended
        condition = Condition.parse(recording.header.condition)
    goals = generate_goal_set(scene, 1, seed=5, counts={"2D": 1})
    plan = TrialPlan("real_ild", condition, scene, goals, 0, 2000, path, settings=SMALL)
    assert ExtrinsicPhase(plan, 1, folder / "score.json").run(ignore).is_complete


class Remembered:
    """An image for every moment, and random macros."""

    def __init__(self, images: NDArray[np.uint8]) -> None:
        self.images, self.random, self.n_proposed = images, np.random.default_rng(0), 0

    def propose(self) -> Action:
        self.n_proposed += 1
        return Action.macro(self.random.uniform(-0.2, 0.0, (2, 2)))

    def live(self, curiosity: Curiosity, joints: NDArray[np.float64] = HOME) -> list[int]:
        """How many proposals each action took."""
        counts = []
        for image in self.images:
            before = self.n_proposed
            curiosity.choose({"retina": image, "joint_positions": joints}, self.propose)
            counts.append(self.n_proposed - before)
        return counts


def curiosity(every: int = 4) -> Curiosity:
    return Curiosity(CuriositySettings.model_validate({**CURIOSITY, "every": every}))


def noise(n: int) -> NDArray[np.uint8]:
    return np.random.default_rng(1).integers(0, 255, (n, 240, 320, 3)).astype(np.uint8)


def test_first_proposal_is_taken_before_learning() -> None:
    assert Remembered(noise(4)).live(curiosity()) == [1] * 4


def test_random_action_is_taken_where_all_images_are_alike() -> None:
    still = np.repeat(noise(1), 9, axis=0)
    assert Remembered(still).live(curiosity()) == [1] * 4 + [9] * 5  # 8 candidates, then any


def test_nothing_is_learned_while_the_arm_is_in_view() -> None:
    assert Remembered(noise(6)).live(curiosity(), np.ones(9)) == [1] * 4 + [9] * 2


def test_first_candidate_is_taken_if_every_action_changes_something() -> None:
    images, random = np.zeros((45, 240, 320, 3), np.uint8), np.random.default_rng(0)
    for image in images:
        row, column = random.integers(0, (180, 260))
        image[row : row + 60, column : column + 60] = 255
    counts = Remembered(images).live(curiosity(every=40))
    assert counts == [1] * 40 + [8] * 5  # all candidates are made at once, the first is taken
