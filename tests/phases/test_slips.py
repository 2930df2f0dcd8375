"""Frequent slips in a controller's code get a message that says what to write."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from real_bench.cli.describing import describe_recording
from real_bench.conditions import Condition
from real_bench.controller_code.blame import blame
from real_bench.controller_code.finding import find_controller
from real_bench.errors import ControllerError, RealBenchError, SubmissionError
from real_bench.inputs import whole
from real_bench.observation import missing_key
from real_bench.phases.extrinsic import ExtrinsicPhase
from real_bench.phases.intrinsic import IntrinsicPhase
from real_bench.phases.local import LocalBackend
from real_bench.phases.plans import plan_test
from real_bench.phases.player import make_player
from real_bench.phases.proxy import ControllerBackend
from real_bench.recording import Recording
from real_bench.sandbox import SandboxBackend
from real_bench.simulation import Scene
from real_bench.task import Task

HEAD = """
from real_bench import Action, Controller, Settings

class Mine(Controller):
"""
ACTS = """
    def next_action(self, observation):
        LINE
        return Action.rest(4, 20)
"""
BACKENDS = pytest.mark.parametrize(
    "backend", [LocalBackend(), SandboxBackend()], ids=["here", "isolated"]
)
KEYS = "depth, goal, joint_positions, retina, touch_sensors"


def play(
    folder: Path, scene: Scene, code: str, backend: ControllerBackend, condition: str = "IM"
) -> Path:
    """The recording of 60 steps."""
    file, out = folder / "mine.py", folder / "run.h5"
    file.write_text(HEAD + code)
    condition_of = Condition.parse(condition)
    phase = IntrinsicPhase(str(file), condition_of, 1, scene, 60, 0, out, backend=backend)
    phase.run(lambda _: None).close()
    return out


@BACKENDS
@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("observation['object_positions']", f"{KEYS}; only conditions with O have it"),
        ("observation['retinas']", KEYS),
    ],
)
def test_a_value_that_is_not_observed_lists_those_that_are(
    tmp_path: Path, builtin_scene: Scene, backend: ControllerBackend, line: str, told: str
) -> None:
    with pytest.raises(ControllerError) as raised:
        play(tmp_path, builtin_scene, ACTS.replace("LINE", line), backend)
    assert str(raised.value).endswith(f"(an observation here has {told})")


@BACKENDS
def test_other_missing_keys_are_the_controllers_own(
    tmp_path: Path, builtin_scene: Scene, backend: ControllerBackend
) -> None:
    with pytest.raises(ControllerError, match=r"KeyError: 'memories'$"):
        play(tmp_path, builtin_scene, ACTS.replace("LINE", "{}['memories']"), backend)


def test_only_missing_keys_get_a_hint() -> None:
    assert missing_key(KeyError(), ["retina"]) == ""
    assert missing_key(KeyError(5), ["retina"]) == ""
    assert missing_key(KeyError("retina"), ["retina"]) == ""


@BACKENDS
def test_settings_need_no_constructor(
    tmp_path: Path, builtin_scene: Scene, backend: ControllerBackend
) -> None:
    settings = "    class Settings(Settings):\n        length: float = 0.3\n"
    code = settings + ACTS.replace("LINE", "self.log('length', self.settings.length)")
    with Recording(play(tmp_path, builtin_scene, code, backend)) as recording:
        assert recording.header.settings == {"length": 0.3}
        assert set(recording.logged["value"]) == {0.3}


@BACKENDS
def test_a_hook_that_cannot_be_called_is_told_as_the_controllers(
    tmp_path: Path, builtin_scene: Scene, backend: ControllerBackend
) -> None:
    code = "    def seed(self):\n        pass\n" + ACTS.replace("LINE", "pass")
    with pytest.raises(ControllerError) as told:
        play(tmp_path, builtin_scene, code, backend)
    file = tmp_path / "mine.py"
    assert f"seed() failed at {file}, line 5: it must be seed(self, seed)" in str(told.value)


@BACKENDS
@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ("        path: 'Path' = 0", "PydanticUserError: `Settings` is not fully defined"),
        (
            "        @__import__('pydantic').field_validator('n')\n"
            "        def no(cls, n): return {}['x']",
            "KeyError: 'x'",
        ),
    ],
)
def test_a_class_of_settings_that_fails_is_the_controllers_fault(
    tmp_path: Path, builtin_scene: Scene, backend: ControllerBackend, settings: str, told: str
) -> None:
    code = f"    class Settings(Settings):\n        n: int = 1\n{settings}\n{ACTS}"
    code = code.replace("LINE", "pass")
    with pytest.raises(SubmissionError, match=f"its class of settings fails: {told}"):
        play(tmp_path, builtin_scene, code, backend)


@BACKENDS
def test_an_action_of_another_control_is_told_what_to_return(
    tmp_path: Path, builtin_scene: Scene, backend: ControllerBackend
) -> None:
    with pytest.raises(ControllerError, match=r"with joints return Action\.via_points"):
        play(tmp_path, builtin_scene, ACTS.replace("LINE", "pass"), backend, "IJ")


def test_our_own_controllers_are_told_with_their_line() -> None:
    """They are installed within the package."""
    with pytest.raises(RealBenchError) as raised:
        whole.whole("x", "steps")
    told = blame(raised.value, Path(whole.__file__))
    assert re.match(rf"{whole.__file__}, line \d+: RealBenchError: steps must be", told)


def test_what_is_recorded_before_a_failure_is_told(
    tmp_path: Path, builtin_scene: Scene, caplog: pytest.LogCaptureFixture
) -> None:
    code = "    def use_experience(self, experience):\n        raise ValueError('a bug')\n"
    with pytest.raises(ControllerError, match="a bug"):
        play(tmp_path, builtin_scene, code + ACTS.replace("LINE", "pass"), LocalBackend())
    kept = f"60 steps are recorded in {tmp_path / 'run.h5'}: once what fails is mended, --resume"
    assert any(record.message.startswith(kept) for record in caplog.records)


@BACKENDS
def test_a_state_that_cannot_be_stored_keeps_the_actions_before_it(
    tmp_path: Path,
    builtin_scene: Scene,
    backend: ControllerBackend,
    caplog: pytest.LogCaptureFixture,
) -> None:
    code = ACTS.replace("LINE", "self.n += 1") + (
        "    n = 0\n"
        "    def get_state(self): return {'n': self.n, 'seen': {1} if self.n == 3 else []}\n"
        "    def set_state(self, state): self.n = state['n']\n"
    )
    with pytest.raises(ControllerError, match="seen"):
        play(tmp_path, builtin_scene, code, backend)
    with Recording(tmp_path / "run.h5") as recording:
        assert recording.n_steps > 0
    assert "--resume continues" in caplog.text


def test_a_kept_observation_is_named_when_it_cannot_be_copied(
    tmp_path: Path, builtin_scene: Scene
) -> None:
    code = ACTS.replace("LINE", "self.last = observation")
    run = play(tmp_path, builtin_scene, code, LocalBackend())
    with Recording(run) as recording:
        assert recording.n_steps == 60
    task = Task(builtin_scene, Condition.parse("IM"), 1)
    proxy = LocalBackend().proxy(str(tmp_path / "mine.py"), {}, task)
    task.begin()
    make_player(proxy, task).play(20)
    with pytest.raises(ControllerError, match="keep the values that you need"):
        proxy.copy()
    task.close()


def test_a_play_whose_end_failed_is_tested_with_a_warning(
    tmp_path: Path, builtin_scene: Scene, caplog: pytest.LogCaptureFixture
) -> None:
    code = ACTS.replace("LINE", "pass") + (
        "    def end_intrinsic_phase(self, observation, reward, done): raise ValueError('a bug')\n"
    )
    with pytest.raises(ControllerError, match="a bug"):
        play(tmp_path, builtin_scene, code, LocalBackend())
    caplog.clear()
    plan_test(run=tmp_path / "run.h5")
    assert "run.h5 has all 60 steps, but what the controller does at their end" in caplog.text


@BACKENDS
def test_a_controller_may_change_its_folder_and_ours_stays(
    tmp_path: Path,
    builtin_scene: Scene,
    backend: ControllerBackend,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    code = ACTS.replace(
        "LINE",
        "import os, tempfile"
        "\n        if not hasattr(self, 'own'): self.own = tempfile.mkdtemp(); os.chdir(self.own)"
        "\n        assert os.path.samefile(self.own, os.getcwd())",
    )
    play(Path(), builtin_scene, code, backend)
    assert Path.cwd() == tmp_path
    with Recording(tmp_path / "run.h5") as recording:
        assert recording.ended
    plan = plan_test(run=Path("run.h5"), trial_steps=60, backend=backend, wanted="nothing")
    ExtrinsicPhase(plan, 2, Path("score.json"), 1).run(lambda _: None)
    assert (tmp_path / "score.json").exists()


def test_a_play_that_goes_on_with_other_code_says_so(
    tmp_path: Path, builtin_scene: Scene, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "mine.py").write_text(HEAD + ACTS.replace("LINE", "pass"))

    def go_on(steps: int) -> None:
        condition = Condition.parse("IM")
        who = str(tmp_path / "mine.py")
        phase = IntrinsicPhase(who, condition, 1, builtin_scene, steps, 0, tmp_path / "run.h5")
        phase.run(lambda _: None, resume=True).close()

    go_on(60)
    go_on(80)
    assert "other code" not in caplog.text
    with (tmp_path / "mine.py").open("a") as file:
        file.write("# mended\n")
    go_on(100)
    assert "not that of before step 80" in caplog.text
    assert describe_recording(tmp_path / "run.h5")["code_changed_at_steps"] == [80]


def test_a_module_in_the_folder_tells_how_to_import_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine_pkg").mkdir()
    (tmp_path / "mine_pkg" / "ctrl.py").write_text("from . import nothing\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ControllerError, match=r"set PYTHONPATH=\."):
        find_controller("mine_pkg.ctrl:Mine")
    with pytest.raises(ControllerError, match=r"and mine_pkg\.ctrl:Class"):
        find_controller("mine_pkg/ctrl.py")


def test_a_controller_may_remove_the_folder_that_it_is_in(
    tmp_path: Path, builtin_scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    line = "import os, tempfile; own = tempfile.mkdtemp(); os.chdir(own); os.rmdir(own)"
    play(Path(), builtin_scene, ACTS.replace("LINE", line), LocalBackend())
    assert Path.cwd() == tmp_path
