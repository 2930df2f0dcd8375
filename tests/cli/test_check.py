"""What `realbench check` tries, and the commands that it suggests."""

from __future__ import annotations

import shutil
from pathlib import Path

from real_bench.simulation.scene import manifest_path
from tests.cli.shell import realbench

MINE = """
from real_bench import Action, Controller
from real_bench.settings import Settings

class Mine(Controller):
    class Settings(Settings):
        seconds: float = 0.1

    def use_experience(self, experience):
        pass

    def next_action(self, observation):
        return Action.rest(9, 20)
"""


def test_suggested_commands_have_what_was_checked(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(MINE)
    told = realbench(
        *(tmp_path, "check", "mine.py", "--condition", "OJ", "--objects", "2"),
        *("--scene", "builtin", "--set", "seconds=2"),
    ).stdout
    play, test = (line.strip() for line in told.splitlines() if "realbench " in line)
    assert play == (
        "realbench intrinsic --controller mine.py --condition OJ --scene builtin --set seconds=2 "
        "--objects 2"
    )
    assert test == "realbench extrinsic"
    assert told.count("a goal, after") == 2


def test_scene_of_ones_own_has_no_goal_to_try(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(MINE)
    shutil.copytree(manifest_path("builtin").parent, tmp_path / "ours")
    manifest = tmp_path / "ours/scene.yaml"
    manifest.write_text(manifest.read_text().replace("name: builtin", "name: ours"))
    told = realbench(
        *(tmp_path, "check", "mine.py", "--condition", "OJ", "--scene", "ours/scene.yaml")
    ).stdout
    assert told.count("not tried: no goals ship for the scene") == 2
    assert "--scene ours/scene.yaml" in told


def test_hook_that_is_misspelt_is_told_with_the_one_that_may_be_meant(tmp_path: Path) -> None:
    """In this process and in isolation; what is only similar, or private, is one's own."""
    slips = "    learn_across_trials = True\n    _seed = 3\n    steps, logs, position = 0, 1, 2\n"
    slips += "    def seeds(self, seed):\n        pass\n"
    (tmp_path / "mine.py").write_text(MINE.replace("use_experience", "use_experiences") + slips)
    told = realbench(tmp_path, "check", "mine.py", "--scene", "builtin", "--condition", "OJ").stdout
    meant = (
        "unknown here: use_experiences (did you mean use_experience?), learn_across_trials "
        "(did you mean learns_across_trials?), seeds (did you mean seed?)"
    )
    assert " ".join(told.split()).count(meant) == 2
    assert "logs" not in told
    assert "step?" not in told
    (tmp_path / "mine.py").write_text(MINE.replace("next_action", "next_actoin"))
    told = realbench(tmp_path, "check", "mine.py", "--scene", "builtin", code=1).stdout
    assert "neither step() nor next_action(); next_actoin: did you mean next_action?" in told
