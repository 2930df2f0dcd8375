"""A result is of exactly what was tested: other code or settings never go in by the back door."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from real_bench.goal_sets import load_goal_set, save_goal_set
from real_bench.report import read_played, read_tested
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from tests.cli.shell import realbench, tiny_goals

LEARNER = """
import helper
from real_bench.actions import Action
from real_bench.controller import Controller
from real_bench.settings import Settings

class LearnerSettings(Settings):
    lr: float = 0.1

class Learner(Controller):
    Settings = LearnerSettings

    def __init__(self, action_space, observation_space, settings):
        super().__init__(action_space, observation_space)
        self.lr, self.learned = settings.lr, 0.0

    def next_action(self, observation):
        self.learned += self.lr
        return Action.macro([[-0.1, 0.2 + 0.01 * self.learned], [-0.1, helper.END]])

    def get_state(self):
        return {"learned": self.learned}

    def set_state(self, state):
        self.learned = state["learned"]
"""
PLAY = ("--scene", "builtin", "--condition", "OM", "--steps", "2000", "--overwrite")
TEST = ("--goals", "goals.npy", "--trial-steps", "1000")


@pytest.fixture
def place(tmp_path: Path, builtin_scene: Scene) -> Path:
    """A folder with a controller that has played, its helper, and goals."""
    save_goal_set(tiny_goals(builtin_scene), tmp_path / "goals.npy")
    (tmp_path / "learner.py").write_text(LEARNER)
    (tmp_path / "helper.py").write_text("END = -0.2\n")
    whom = ("--controller", "learner.py", "--scene", "builtin", "--condition", "OM")
    realbench(tmp_path, "intrinsic", *whom, "--steps", "2000")
    return tmp_path


def test_result_cannot_be_resumed_after_a_helper_was_edited(place: Path) -> None:
    realbench(place, "extrinsic", *TEST, "--trials", "1")
    before = (place / "score.json").read_bytes()
    (place / "helper.py").write_text("END = -0.3\n")
    again = ("--trials", "2", "--resume")
    refused = realbench(place, "extrinsic", *TEST, *again, code=1).stderr
    assert "was learned with different code" in refused
    refused = realbench(place, "extrinsic", *TEST, *again, "--keep-learned", code=1).stderr
    assert "is of another test and cannot be resumed: controller_sha256 differ" in refused
    assert (place / "score.json").read_bytes() == before


def test_changed_settings_need_keep_learned_or_relearn(place: Path) -> None:
    refused = realbench(place, "extrinsic", *TEST, "--set", "lr=0.5", code=1).stderr
    assert "different settings (lr=0.1, now 0.5): use --keep-learned" in refused
    assert "--relearn" in refused
    assert not (place / "score.json").exists()
    realbench(place, "extrinsic", *TEST, "--set", "lr=0.5", "--keep-learned")
    setting = load_result(place / "score.json").setting
    assert setting.settings == {"lr": 0.5}
    assert setting.learned is not None
    assert setting.learned.settings == {"lr": 0.1}
    anew = ("--set", "lr=0.5", "--relearn", "--overwrite")
    refused = realbench(place, "extrinsic", *TEST, *anew, code=1).stderr
    assert "cannot learn from a recording again" in refused


def test_relearn_option_learns_again_from_the_recording(place: Path) -> None:
    play = ("--controller", "real_d", "--scene", "builtin", "--condition", "OM", "--overwrite")
    realbench(place, "intrinsic", *play, "--steps", "4000")
    depth = ("--set", "planner.depth=2")
    refused = realbench(place, "extrinsic", *TEST, *depth, code=1).stderr
    assert "planner.depth=10, now 2" in refused
    realbench(place, "extrinsic", *TEST, *depth, "--relearn")
    setting = load_result(place / "score.json").setting
    assert setting.learned is None
    assert setting.settings["planner"]["depth"] == 2


def test_the_same_code_in_another_place_is_the_same_controller(place: Path) -> None:
    elsewhere = place / "elsewhere"
    elsewhere.mkdir()
    for name in ("learner.py", "helper.py"):
        (elsewhere / name).write_bytes((place / name).read_bytes())
    realbench(place, "extrinsic", "--controller", "elsewhere/learner.py", *TEST)
    assert load_result(place / "score.json").setting.learned is not None


@pytest.mark.parametrize("options", [(), ("--run-steps", "2000")])
def test_whole_play_hands_over_what_was_learned_however_it_is_asked_for(
    place: Path, options: tuple[str, ...]
) -> None:
    realbench(place, "extrinsic", *TEST, *options)
    result = load_result(place / "score.json")
    assert result.setting.learned is not None
    play = read_played(place / "run.h5")
    goals = [("goals.npy", load_goal_set(place / "goals.npy"))]
    command = read_tested(place / "score.json", [play], goals).command
    assert "--run-steps" not in command
    realbench(place, *shlex.split(command)[1:], "--overwrite")
    assert load_result(place / "score.json") == result.model_copy(
        update={"seconds": load_result(place / "score.json").seconds}
    )


def test_part_of_a_play_is_for_those_who_learn_from_recordings(place: Path) -> None:
    part = ("--run-steps", "1000")
    refused = realbench(place, "extrinsic", *TEST, *part, code=1).stderr
    assert "cannot learn from a part of run.h5: it has no use_experience()" in refused
    refused = realbench(place, "extrinsic", *TEST, *part, "--keep-learned", code=1).stderr
    assert "came from all of its steps: leave out --keep-learned or --run-steps" in refused
    assert not (place / "score.json").exists()
    realbench(place, "extrinsic", *TEST, *part, "--as-made")
    setting = load_result(place / "score.json").setting
    assert (setting.learned, setting.learned_from) == (None, "nothing")
    assert setting.run_steps == 1000
    play = read_played(place / "run.h5")
    assert "--run-steps 1000 --as-made " in read_tested(place / "score.json", [play]).command


def test_who_learns_from_recordings_is_not_tested_as_made(place: Path) -> None:
    """It would learn all the same, and nothing in its result would say whether it did."""
    learns = "\n    def use_experience(self, experience):\n        self.learned = 1.0\n"
    (place / "learner.py").write_text(LEARNER + learns)
    for part in ((), ("--run-steps", "1000")):
        refused = realbench(place, "extrinsic", *TEST, *part, "--as-made", code=1).stderr
        assert "learns from run.h5 (use_experience), so it is never tested as made" in refused
    assert not (place / "score.json").exists()


def test_controller_that_was_moved_and_edited_is_told_that_its_settings_are_not_used(
    place: Path,
) -> None:
    """They are its own only as long as it is the same code, or lies where it was."""
    play = ("--controller", "real_t", "--scene", "builtin", "--condition", "OM", "--overwrite")
    realbench(place, "intrinsic", *play, "--steps", "2000", "--set", "planner.depth=2")
    (place / "mine.py").write_text("from real_bench.controllers.real_t import RealT\n")
    told = realbench(place, "extrinsic", "--controller", "mine.py:RealT", *TEST).stderr
    assert "the play was by real_t, whose code is different: its settings are not used" in told
    assert load_result(place / "score.json").setting.settings["planner"] == {"depth": 10}


def test_controller_that_learns_from_no_recording_is_told_to_be_tested_as_made(
    place: Path,
) -> None:
    (place / "plain.py").write_text(
        LEARNER.replace("Learner(", "Plain(").partition("    def get")[0]
    )
    told = realbench(place, "extrinsic", "--controller", "plain.py", *TEST)
    assert "plain.py does not learn from recordings (it has no use_experience())" in told.stderr
    assert "is tested as made" in told.stderr
    title = " ".join(told.stdout.split())
    assert "scene builtin, as made, nothing learned from 2,000 steps of play" in title


def test_what_played_in_the_same_process_is_never_averaged_with_what_did_not(place: Path) -> None:
    """Their files differ in nothing else; the report has the command of each."""
    (place / "plain.py").write_text(
        LEARNER.replace("Learner(", "Plain(").partition("    def get")[0]
    )
    whom = ("--controller", "plain.py", *TEST, "--seed", "1", "--out")
    realbench(place, "evaluate", *PLAY, "--run", "run.h5", *whom, "at-once.json")
    realbench(place, "extrinsic", *whom, "as-made.json", "--as-made")
    refused = realbench(place, "score", "at-once.json", "as-made.json", code=1).stderr
    assert "never averaged: learned from nothing and process" in refused
    play, goals = read_played(place / "run.h5"), load_goal_set(place / "goals.npy")
    for name, verb in (("at-once", "evaluate"), ("as-made", "extrinsic")):
        before = load_result(place / f"{name}.json")
        command = read_tested(place / f"{name}.json", [play], [("goals.npy", goals)]).command
        assert command.startswith(f"realbench {verb} ")
        realbench(place, *shlex.split(command)[1:], "--overwrite")
        assert load_result(place / f"{name}.json").trials == before.trials


def test_recording_that_is_replaced_during_its_test_ends_the_test(place: Path) -> None:
    """What is learned now would not be of the recording whose hash the result has."""
    (place / "learner.py").write_text(
        f"{LEARNER}\n    def start_extrinsic_trial(self):\n"
        "        import pathlib, shutil\n"
        "        if pathlib.Path('other.h5').exists():\n"
        "            pathlib.Path('other.h5').replace('run.h5')\n"
    )
    realbench(place, "intrinsic", "--controller", "learner.py", *PLAY)
    other = ("--seed", "9", "--out", "other.h5")
    realbench(place, "intrinsic", "--controller", "learner.py", *PLAY, *other)
    told = realbench(place, "extrinsic", *TEST, code=1).stderr
    assert "run.h5 was replaced or changed during the test: test again (--overwrite)" in told
    assert not (place / "score.json").exists()
