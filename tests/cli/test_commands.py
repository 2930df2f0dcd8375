"""Every command, run for real on something short."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from PIL import Image

from real_bench.cli import COMMANDS, cli
from real_bench.goal_sets import save_goal_set
from real_bench.phases.plans import plan_test
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from tests.cli.shell import realbench, tiny_goals

FULL_SCALE = Path(__file__).parents[2] / "evaluation" / "results" / "full-scale"
KEPT = FULL_SCALE / "real_gj-IJ-1-seed715-shipped.json"
UNPLAYED = FULL_SCALE / "real_r-IJ-1-seed0-shipped.json"

CLASS_API = '''
from real_robots.policy import BasePolicy
import numpy as np

class Pusher(BasePolicy):
    """Keeps in itself what it saw in free play, as the official evaluation let it."""
    def __init__(self, action_space, observation_space):
        self.action_space = action_space
        self.n_seen = 0
    def start_extrinsic_phase(self):
        assert self.n_seen == 2000, self.n_seen
    def step(self, observation, reward, done):
        self.n_seen += 1
        return {"macro_action": np.array([[-0.1, 0.2], [-0.1, -0.2]]), "render": False}
'''


@pytest.fixture(scope="module")
def workplace(tmp_path_factory: pytest.TempPathFactory, builtin_scene: Scene) -> Path:
    """A folder with goals, a short run and its result."""
    folder = tmp_path_factory.mktemp("workplace")
    save_goal_set(tiny_goals(builtin_scene), folder / "goals.npy")
    play = ["intrinsic", "--controller", "real_r", "--scene", "builtin", "--condition", "OM"]
    realbench(folder, *play, "--steps", "3000")
    realbench(folder, "extrinsic", "--goals", "goals.npy")
    return folder


def test_help_has_an_example_for_every_command() -> None:
    for command in COMMANDS:
        assert "Example:" in realbench(Path(), command, "--help").stdout or command == "scene"
    for subcommand in ("install", "list"):
        assert "Example:" in realbench(Path(), "scene", subcommand, "--help").stdout
    for subcommand in ("generate", "show", "import"):
        assert "Example:" in realbench(Path(), "goals", subcommand, "--help").stdout


def test_every_group_alone_prints_its_help() -> None:
    context = click.Context(cli)
    groups = [name for name in COMMANDS if isinstance(cli.get_command(context, name), click.Group)]
    assert {"goals", "round", "scene", "submission"} <= set(groups)
    for group in groups:
        assert "\nCommands:\n" in realbench(Path(), group).stdout


def test_help_lists_every_command() -> None:
    text = realbench(Path(), "--help").stdout
    assert all(command in text for command in COMMANDS)


@pytest.mark.parametrize("command", [(), ("goals",), ("scene",)])
def test_a_command_alone_prints_its_help(command: tuple[str, ...]) -> None:
    done = realbench(Path(), *command)
    assert done.stdout == realbench(Path(), *command, "--help").stdout
    assert done.stderr == ""


@pytest.mark.parametrize("command", [("intrinsic",), ("goals", "show"), ("table",), ("doctor",)])
def test_every_command_takes_the_common_options(command: tuple[str, ...]) -> None:
    told = realbench(Path(), *command, "--help").stdout
    assert "--traceback" in told
    assert "--no-progress" in told


def test_the_command_line_imports_nothing_heavy() -> None:
    code = (
        "import sys, real_bench.cli as c\n"
        "try: c.main(['--help'])\nexcept SystemExit: pass\n"
        "print(sorted({'pybullet', 'h5py', 'scipy', 'av', 'torch', 'PIL', 'pydantic'}"
        " & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


def test_shortest_commands_print_a_score_table(workplace: Path) -> None:
    table = realbench(workplace, "extrinsic", "--goals", "goals.npy", "--overwrite").stdout
    for word in ("real_r", "REAL_OM", "builtin", "2D", "total", "95% over goals"):
        assert word in table


@pytest.mark.parametrize(
    ("file", "facts"),
    [
        ("run.h5", {"triplets": 3, "steps": 3000, "scene": "builtin", "images": 0}),
        ("goals.npy", {"goals": 2, "scene": "builtin"}),
        ("score.json", {"trials": "2 of 2", "scene": "builtin"}),
    ],
)
def test_inspect_says_what_is_in_a_file(workplace: Path, file: str, facts: dict[str, int]) -> None:
    told = json.loads(realbench(workplace, "inspect", file, "--json").stdout)
    assert {key: told[key] for key in facts} == facts
    assert "scene" in realbench(workplace, "inspect", file).stdout


def test_inspect_prints_what_people_can_read_and_paste(tmp_path: Path) -> None:
    told = realbench(tmp_path, "inspect", str(KEPT)).stdout
    lines = [line for line in told.splitlines() if not line.startswith(" ")]
    facts = {name: value.strip() for name, _, value in (line.partition("  ") for line in lines)}
    assert facts["goal numbers"] == "0 to 49"
    assert facts["complete"] == "yes"
    assert (facts["run steps"], facts["seed"]) == ("15,000,000", "715")
    assert "run sha256         none" in realbench(tmp_path, "inspect", str(UNPLAYED)).stdout
    assert "play.bred=0.45," in told  # as --set takes it
    assert max(map(len, lines[1:])) <= 100


def test_json_option_prints_only_json(workplace: Path) -> None:
    test = ["extrinsic", "--goals", "goals.npy", "--trial-steps", "1000"]
    told = json.loads(realbench(workplace, *test, "--out", "short.json", "--json").stdout)
    summary = told.pop("summary")
    assert told == json.loads((workplace / "short.json").read_text())
    assert summary["complete"]
    assert [goal["score"] for goal in summary["goals"]] == [
        trial.score for trial in load_result(workplace / "short.json").trials
    ]


def test_result_and_recording_verify(workplace: Path) -> None:
    arguments = ["score.json", "--goals", "goals.npy", "--run", "run.h5", "--controller", "real_r"]
    proved = realbench(workplace, "verify", *arguments).stdout
    assert "verified: 2 of 2 trials replay bit for bit" in proved
    assert "note" not in proved
    assert "3,000 of 3,000 steps" in realbench(workplace, "verify", "run.h5").stdout


def test_extrinsic_writes_pictures_and_films_of_trials(workplace: Path) -> None:
    arguments = ["--goals", "goals.npy", "--out", "filmed.json", "--trials", "1"]
    shown = ["--trial-steps", "1000", "--pictures", "pictures", "--video", "films"]
    realbench(workplace, "extrinsic", *arguments, *shown)
    with Image.open(workplace / "pictures" / "trial-00.png") as picture:
        assert picture.width > 3 * 320
    assert (workplace / "films" / "trial-00.mp4").stat().st_size > 10_000


def test_result_on_part_of_the_goals_is_marked_as_a_part(workplace: Path) -> None:
    part = ["extrinsic", "--goals", "goals.npy", "--trials", "1", "--out", "part.json"]
    assert "a part: only 1 of 2 goals" in realbench(workplace, *part).stdout
    told = json.loads(realbench(workplace, "inspect", "part.json", "--json").stdout)
    assert (told["goals_tested"], told["complete"]) == ("1 of 2 goals", False)
    refused = realbench(workplace, "score", "part.json", "--goals", "goals.npy", code=3)
    assert "1 of 2" in refused.stderr
    realbench(workplace, "score", "part.json", "--goals", "goals.npy", "--allow-part")


def test_evaluate_runs_both_phases(workplace: Path) -> None:
    (workplace / "pusher.py").write_text(CLASS_API)
    arguments = ["evaluate", "--controller", "pusher.py", "--condition", "OM"]
    arguments += ["--scene", "builtin", "--steps", "2000", "--goals", "goals.npy", "--trials", "1"]
    arguments += ["--trial-steps", "1000", "--run", "both.h5", "--out", "both.json"]
    done = realbench(workplace, *arguments)
    assert "total" in done.stdout


def test_doctor_measures_this_machine(workplace: Path) -> None:
    facts = json.loads(realbench(workplace, "doctor", "--scene", "builtin", "--json").stdout)
    assert facts["steps_per_second_at_rest"] > 0
    assert facts["scene"] == "builtin"


def test_scenes_are_listed() -> None:
    assert "builtin: ready" in realbench(Path(), "scene", "list").stdout


def test_default_recording_that_does_not_fit_is_ignored(
    workplace: Path, builtin_scene: Scene
) -> None:
    save_goal_set(tiny_goals(builtin_scene, n_objects=2), workplace / "two.npy")
    arguments = ["--controller", "real_r", "--condition", "OM", "--objects", "2"]
    arguments += ["--scene", "builtin", "--goals", "two.npy", "--out", "two.json", "--trials", "1"]
    done = realbench(workplace, "extrinsic", *arguments, "--trial-steps", "500")
    assert "run.h5 is not used: it has 1 object, not 2" in done.stderr
    assert json.loads((workplace / "two.json").read_text())["setting"]["run_steps"] == 0


@pytest.mark.parametrize(
    "given",
    [
        {"condition": "OJ"},
        {"objects": 2},
        {"scene": "official"},
        {"goals": "two.npy"},
        {"condition": "IJ", "objects": 1},
    ],
)
def test_what_is_not_used_decides_nothing(
    workplace: Path,
    builtin_scene: Scene,
    official_scene: Scene,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    given: dict[str, Any],
) -> None:
    """A test beside a recording that does not fit is the test that it would be elsewhere."""
    for folder in (workplace, tmp_path):
        save_goal_set(tiny_goals(builtin_scene, n_objects=2), folder / "two.npy")
    plans = []
    for folder in (workplace, tmp_path):
        monkeypatch.chdir(folder)
        in_builtin = {"scene": "builtin"} if "goals" in given else {}
        plan = plan_test(**{"controller": "real_r", **in_builtin, **given})
        plans.append((plan.run, plan.condition, plan.scene.name, plan.goal_set.sha256, plan.seed))
    assert plans[0] == plans[1]


def test_the_goal_file_loads_without_pickle(workplace: Path) -> None:
    rows = np.load(workplace / "goals.npy", allow_pickle=False)
    assert rows["final_poses"].shape == (2, 1, 7)
