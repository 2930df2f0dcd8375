"""The module `real_robots` outside realbench: in the scripts and unit tests of authors."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from real_bench.controls.joints import JointControl
from real_bench.phases.official import OfficialActions
from real_bench.simulation import Scene
from tests.compat.conftest import RunScript

INSTALL = """
import real_bench.compat
real_bench.compat.install()
"""
LOOP = """
import gymnasium as gym
import numpy as np
import real_robots
from real_robots.policy import BasePolicy

class Waver(BasePolicy):
    def step(self, observation, reward, done):
        bend = 0.2 if observation["joint_positions"][0] < 0.1 else 0.0
        return {"joint_command": np.full(9, bend), "render": False}

env = gym.make("REALRobot2020-R1J2-v0")
env.intrinsic_timesteps = 30
policy = Waver(env.action_space, env.observation_space)
observation, reward, done, n_steps = env.reset(), 0, False, 0
policy.start_intrinsic_phase()
while not done:
    observation, reward, done, info = env.step(policy.step(observation, reward, done))
    n_steps += 1
policy.end_intrinsic_phase(observation, reward, done)
print(n_steps, reward, info, sorted(env.get_all_used_objects()))
"""
EVALUATION = """
import numpy as np
import real_robots
from real_robots.envs import Goal
from real_robots.policy import BasePolicy

class Rests(BasePolicy):
    def step(self, observation, reward, done):
        return {"macro_action": None, "render": False}

class Fails(BasePolicy):
    def step(self, observation, reward, done):
        return observation["smell"]

goals = np.empty(1, object)
at = {"cube": np.array([-0.1, 0.2, 0.3213, 0, 0, 0, 1.0])}
image, mask = np.zeros((240, 320, 3), np.uint8), np.zeros((240, 320), np.int32)
goals[0] = Goal(at, at, image, image, "2D", mask)
np.savez_compressed("goals.npy.npz", goals)

def tried(kind=Rests, **options):
    plain = {"intrinsic_timesteps": 10, "extrinsic_timesteps": 10, "extrinsic_trials": 1}
    try:
        print(real_robots.evaluate(kind, **{**plain, "visualize": False, **options}))
    except Exception as error:
        print(type(error).__name__, error, "<-", repr(error.__cause__))

tried()
tried(Fails)
tried(environment="easy")
tried(action_type="macro")
tried(extrinsic_trials=2)
tried(n_objects=2)
tried(goals_dataset_path="elsewhere.npz")
tried(kind=Rests(None, None))
tried(visualize=True)
"""
WHICH = "import real_robots; print(real_robots.__file__)"
ANOTHER = "__file__ = 'another'\n"


@pytest.fixture
def another(tmp_path: Path) -> Path:
    """A folder in which another package of that name is installed."""
    package = tmp_path / "installed" / "real_robots"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("class policy: BasePolicy = object\n")
    (package / "policy.py").write_text("class BasePolicy: pass\n")
    return package.parent


def test_script_with_a_four_value_step_loop_runs(
    run_script: RunScript, official_scene: Scene
) -> None:
    ran = run_script(INSTALL + LOOP)
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout == "30 0 {} ['cube', 'tomato']\n"


def test_evaluation_script_gets_scores_and_clear_errors(
    run_script: RunScript, official_scene: Scene
) -> None:
    ran = run_script(INSTALL + EVALUATION)
    assert ran.returncode == 0, ran.stderr
    fine, failed, *refused = ran.stdout.splitlines()
    assert fine.startswith("({'score_2D': 0.99")
    assert fine.endswith("]})")
    assert "Fails: step() failed at" in failed
    assert failed.endswith("<- KeyError('smell')")
    for line, told in zip(
        refused,
        [
            "environment must be R1 or R2",
            "action_type must be one of ",
            "extrinsic_trials must be a whole number from 0 to 1, not 2",
            "1 object",
            "cannot read elsewhere.npz",
            "a class with step() was expected",
            "no display",
        ],
        strict=True,
    ):
        assert told in line


def test_our_package_is_imported_where_no_other_is_installed(run_script: RunScript) -> None:
    ran = run_script(INSTALL + WHICH)
    assert "compat/real_robots/__init__.py" in ran.stdout
    assert ran.stderr == ""


def test_an_installed_package_is_not_shadowed(run_script: RunScript, another: Path) -> None:
    ran = run_script(INSTALL + WHICH, path=another)
    assert ran.stdout == f"{another / 'real_robots' / '__init__.py'}\n"
    assert "install(replace=True)" in ran.stderr


def test_an_installed_package_is_replaced_on_request(run_script: RunScript, another: Path) -> None:
    script = INSTALL.replace("install()", "install(replace=True)") + WHICH
    ran = run_script(script + "\nimport real_robots.policy, real_robots.envs", path=another)
    assert "compat/real_robots/__init__.py" in ran.stdout, ran.stderr
    assert f"not the one in {another}" in ran.stderr


def test_package_imported_before_stays(run_script: RunScript, another: Path) -> None:
    ran = run_script("import real_robots\n" + INSTALL + WHICH, path=another)
    assert str(another) in ran.stdout
    assert "stays" in ran.stderr


def test_controllers_loaded_by_realbench_get_our_package(
    run_script: RunScript, another: Path
) -> None:
    controller = another.parent / "mine.py"
    controller.write_text(
        "from real_robots.policy import BasePolicy\n"
        "class Mine(BasePolicy):\n"
        "    def step(self, observation, reward, done): ...\n"
    )
    ran = run_script(
        "from real_bench.controller_code.finding import find_controller\n"
        f"print(find_controller({str(controller)!r}).__mro__[1].__module__)",
        path=another,
    )
    assert ran.stdout == "real_bench.controller\n", ran.stderr
    assert f"not the one in {another}" in ran.stderr


def test_unknown_keys_are_ignored_with_one_warning(caplog: pytest.LogCaptureFixture) -> None:
    actions = OfficialActions("mine.py", JointControl())
    plain = {"joint_command": None, "render": True}
    with caplog.at_level(logging.WARNING):
        assert actions.drop_unknown_keys(plain) is plain
        for _ in range(3):
            assert actions.drop_unknown_keys({**plain, "speed": 2, 7: None}) == plain
    assert len(caplog.records) == 1
    assert "'speed'" in caplog.text
    assert "mine.py" in caplog.text


@pytest.mark.parametrize("strange", [None, [1, 2], "left", 3.0])
def test_non_dict_actions_are_left_to_the_control(strange: object) -> None:
    assert OfficialActions("mine.py", JointControl()).drop_unknown_keys(strange) is strange
