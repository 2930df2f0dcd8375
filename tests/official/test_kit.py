"""A submission in the shape of the starter kits gives the same scores in whatever way it is run."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from real_bench.goal_sets import save_goal_set
from real_bench.recording import Recording
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from tests.cli.shell import realbench, tiny_goals

KIT = Path(__file__).parent / "kit"
CONTROLLER = "my_controller.py"
WHOM = ("--controller", CONTROLLER, "--scene", "builtin")
PLAY = ("--condition", "IM", "--steps", "1500")
TEST = ("--goals", "../goals.npy", "--trial-steps", "1500")


@pytest.fixture
def kit(tmp_path: Path, builtin_scene: Scene) -> Path:
    """A copy of the kit, to be worked in; goals lie outside of it."""
    shutil.copytree(KIT, tmp_path / "kit", ignore=shutil.ignore_patterns("__pycache__"))
    save_goal_set(tiny_goals(builtin_scene), tmp_path / "goals.npy")
    return tmp_path / "kit"


def commands(result: Path) -> list[str]:
    """What was done in each trial, as hashes."""
    return [trial.actions_sha256 for trial in load_result(result).trials]


def test_kit_gives_the_same_commands_however_it_is_run(kit: Path) -> None:
    realbench(kit, "evaluate", *WHOM, *PLAY, *TEST)
    wanted = commands(kit / "score.json")
    assert len(set(wanted)) == 2  # trials are in order, and go on from each other
    learned = (kit / "learned.npy").read_bytes()
    (kit / "learned.npy").unlink()

    realbench(kit, "intrinsic", *WHOM, *PLAY, "--out", "alone.h5")
    assert (kit / "learned.npy").read_bytes() == learned
    for jobs in ("1", "2"):
        out = f"jobs{jobs}.json"
        options: tuple[str, ...] = ("--run", "alone.h5", "--as-made", "--jobs", jobs, "--out", out)
        realbench(kit, "extrinsic", "--controller", CONTROLLER, *TEST, *options)
        assert commands(kit / out) == wanted
    (kit / "learned.npy").unlink()

    realbench(kit, "intrinsic", *WHOM, *PLAY, "--isolate", "--out", "isolated.h5")
    assert not (kit / "learned.npy").exists()
    with Recording(kit / "isolated.h5") as recording:
        assert recording.controller_files() == {"learned.npy": learned}  # the log is not flushed
    for jobs in ("1", "2"):
        out = f"scored{jobs}.json"
        options = ("--run", "isolated.h5", "--jobs", jobs, "--out", out)
        realbench(kit, "score", "--controller", CONTROLLER, *TEST, *options, code=3)
        assert commands(kit / out) == wanted


def test_its_modules_may_share_names_with_ours(kit: Path) -> None:
    for name in ("real_bench", "numpy", "h5py"):
        (kit / name).mkdir()
        (kit / name / "__init__.py").write_text("raise ImportError('not this one')\n")
    (kit / "pusher.py").write_text(
        "from real_bench.actions import Action\n"
        "from real_bench.controller import Controller\n"
        "class Pusher(Controller):\n"
        "    def next_action(self, observation):\n"
        "        return Action.macro([[-0.1, 0.2], [-0.1, -0.2]])\n"
    )
    whom = ("--controller", "pusher.py", "--scene", "builtin", "--condition", "OM")
    realbench(kit, "extrinsic", *whom, *TEST, "--jobs", "2")
    assert len(commands(kit / "score.json")) == 2


def test_testing_an_isolated_play_without_isolation_is_refused(kit: Path) -> None:
    realbench(kit, "intrinsic", *WHOM, *PLAY, "--isolate")
    done = realbench(kit, "extrinsic", "--controller", CONTROLLER, *TEST, code=1)
    assert "played in isolation and wrote learned.npy, log.txt: use --isolate" in done.stderr


def test_check_says_what_runs_and_how_to_run_it(kit: Path) -> None:
    (kit / "run.h5").write_bytes(b"no recording")
    shutil.copy(kit.parent / "goals.npy", kit)
    done = realbench(kit, "check", CONTROLLER)
    assert done.stdout.count(f"ok  loads    class Learner of {kit}/baseline/learner.py") == 2
    assert "hidden from an isolated controller: goals.npy\n" in done.stdout
    command = "realbench evaluate --controller my_controller.py --condition IM --steps 1500"
    assert f"  {command} --trials 2\n" in done.stdout
    found = json.loads(realbench(kit, "check", CONTROLLER, "--json").stdout)
    assert found["good"]
    assert [one["what"] for one in found["isolated"]] == [
        *("loads", "is made", "plays", "copies", "state", "tests"),
    ]


def test_check_finds_a_controller_that_cannot_be_copied(kit: Path) -> None:
    (kit / "copied.py").write_text(
        "from baseline.learner import Learner\n"
        "class Copied(Learner):\n"
        "    learns_across_trials = False\n"
        "    start = 0.3\n"
    )
    done = realbench(kit, "check", "copied.py", "--condition", "IM", code=1)
    assert done.stdout.count("State.caller holds the controller") == 2
    play = ("--condition", "IM", "--steps", "1000")
    done = realbench(
        kit, "intrinsic", "--controller", "copied.py", "--scene", "builtin", *play, code=4
    )
    assert "State.caller holds the controller" in done.stderr
    assert not (kit / "run.h5").exists()


def test_missing_get_state_is_warned_of_and_refused_in_tests(kit: Path) -> None:
    done = realbench(kit, "intrinsic", *WHOM, *PLAY)
    assert "it has neither get_state() nor use_experience()" in done.stderr
    done = realbench(kit, "extrinsic", *TEST, code=1)
    assert "does not hold what it learned" in done.stderr
    assert "realbench evaluate" in done.stderr
    assert "--as-made" in done.stderr


def test_controller_of_the_2019_contract_is_recognised(kit: Path) -> None:
    (kit / "old.py").write_text(
        "from real_robots.policy import BasePolicy\n"
        "class Old(BasePolicy):\n"
        "    def __init__(self, action_space):\n"
        "        self.action_space = action_space\n"
        "    def step(self, observation, reward, done):\n"
        "        return {'joint_command': self.action_space.sample()}\n"
    )
    done = realbench(kit, "check", "old.py", "--condition", "IJ", code=1)
    assert "takes only the action space, as in the competition of 2019" in done.stdout


def test_the_deepest_line_of_the_submission_is_blamed(kit: Path) -> None:
    """Not a library's, and not ours."""
    states = kit / "baseline" / "states.py"
    states.write_text(states.read_text().replace("% 1000 else", "% 1000 or 'ab' @ 1 else"))
    line = (
        states.read_text()
        .splitlines()
        .index("        return self if self.caller.n_calls % 1000 or 'ab' @ 1 else Looking()")
    )
    done = realbench(kit, "evaluate", *WHOM, *PLAY, *TEST, code=4)
    assert f"step() failed at {states}, line {line + 1}: TypeError" in done.stderr
