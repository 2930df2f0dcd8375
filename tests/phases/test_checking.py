"""What a check says of a controller that cannot be tested after its short play."""

from __future__ import annotations

from pathlib import Path

import pytest

from real_bench.competition.standing import STATUS_OF
from real_bench.conditions import Condition
from real_bench.errors import ControllerError
from real_bench.phases.checking import ControllerCheck, Finding
from real_bench.phases.local import LocalBackend
from real_bench.phases.proxy import ControllerBackend
from real_bench.sandbox import SandboxBackend
from real_bench.simulation import Scene
from tests.cli.shell import write_controller

CODE = """
from real_bench import Action, Controller
from real_bench.errors import ControllerError

class Mine(Controller):
    in_trial = False

    def get_state(self):
        return {"plays": True}

    def set_state(self, state):
        pass

    def start_extrinsic_phase(self):
        HOOK

    def start_extrinsic_trial(self):
        self.in_trial = True

    def next_action(self, observation):
        if self.in_trial:
            TRIAL
        return Action.rest(4, 20)
"""
LOCAL, SANDBOX = LocalBackend(), SandboxBackend()


def last_finding(
    folder: Path, scene: Scene, backend: ControllerBackend, hook: str, trial: str = "pass"
) -> Finding:
    """Of a controller with these lines in its hook and in its trials."""
    file = folder / "mine.py"
    file.write_text(CODE.replace("HOOK", hook).replace("TRIAL", trial))
    check = ControllerCheck(
        str(file), Condition.parse("OM"), scene, 1, {}, backend, tests_a_goal=True
    )
    return list(check.findings())[-1]


@pytest.mark.parametrize("backend", [LOCAL, SANDBOX], ids=["here", "isolated"])
def test_a_controller_may_decline_a_test_after_so_short_a_play(
    tmp_path: Path, builtin_scene: Scene, backend: ControllerBackend
) -> None:
    hook = 'raise ControllerError("it needs 1,000 actions")'
    found = last_finding(tmp_path, builtin_scene, backend, hook)
    assert found.good
    assert found.detail.startswith("not tried: it declines after 60 steps of play (")
    assert "it needs 1,000 actions" in found.detail


@pytest.mark.parametrize(
    ("hook", "trial"),
    [
        ("raise ValueError('a bug')", "pass"),
        ("pass", "raise ControllerError('too late')"),
        ("pass", "raise ValueError('a bug')"),
    ],
)
def test_a_controller_that_fails_in_a_test_fails_its_check(
    tmp_path: Path, builtin_scene: Scene, hook: str, trial: str
) -> None:
    found = last_finding(tmp_path, builtin_scene, LOCAL, hook, trial)
    assert not found.good
    assert "a bug" in found.detail or "too late" in found.detail


@pytest.mark.parametrize(
    ("hook", "given"),
    [
        ("end_intrinsic_phase", "self, observation, reward, done"),
        ("use_experience", "self, experience"),
        ("start_extrinsic_phase", "self"),
        ("start_extrinsic_trial", "self"),
    ],
)
def test_an_error_in_any_hook_is_found(
    tmp_path: Path, builtin_scene: Scene, hook: str, given: str
) -> None:
    file = tmp_path / "mine.py"
    write_controller(file, f"def {hook}({given}):", "    self.misspelt")
    om = Condition.parse("OM")
    check = ControllerCheck(str(file), om, builtin_scene, 1, {}, LOCAL, tests_a_goal=True)
    assert f"/mine.py: {hook}() failed at " in list(check.findings())[-1].detail


@pytest.mark.parametrize(("points", "is_beyond"), [("[[5, 5], [7, 7]]", True), ("[0] * 4", False)])
def test_commands_beyond_the_action_space_are_remarked(
    tmp_path: Path, builtin_scene: Scene, points: str, is_beyond: bool
) -> None:
    file = tmp_path / "mine.py"
    file.write_text(CODE.replace("Action.rest(4, 20)", f"Action.macro({points})"))
    check = ControllerCheck(str(file), Condition.parse("OM"), builtin_scene, 1, {}, LOCAL)
    plays = next(finding for finding in check.findings() if finding.what == "plays")
    assert plays.good
    assert ("beyond the action space (from [-0.25, -0.5, " in plays.detail) == is_beyond


LEARNS_LAST = """
from real_bench import Action, Controller

class Mine(Controller):
    best = None

    def next_action(self, observation):
        return Action.rest(4, 20)

    def end_intrinsic_phase(self, observation, reward, done):
        self.best = 7

    def get_state(self):
        return {} if self.best is None else {"best": self.best}

    def set_state(self, state):
        self.best = state.get("bset")
"""


@pytest.mark.parametrize(
    ("backend", "is_mended"),
    [(LOCAL, False), (LOCAL, True), (SANDBOX, False)],
    ids=["here", "mended", "isolated"],
)
def test_a_state_that_is_lost_at_the_end_of_play_is_found(
    tmp_path: Path, builtin_scene: Scene, backend: ControllerBackend, is_mended: bool
) -> None:
    file = tmp_path / "mine.py"
    file.write_text(LEARNS_LAST.replace("bset", "best") if is_mended else LEARNS_LAST)
    check = ControllerCheck(
        str(file), Condition.parse("OM"), builtin_scene, 1, {}, backend, tests_a_goal=True
    )
    last = list(check.findings())[-1]
    assert last.good == is_mended
    if not is_mended:
        assert last.detail == "set_state(get_state()) gives another state (after its play)"


def test_a_state_that_is_never_taken_is_found(tmp_path: Path, builtin_scene: Scene) -> None:
    file = tmp_path / "mine.py"
    file.write_text(CODE.replace("def set_state", "def set_states"))
    check = ControllerCheck(str(file), Condition.parse("OM"), builtin_scene, 1, {}, LOCAL)
    last = list(check.findings())[-1]
    assert not last.good
    assert "define set_state(), too" in last.detail


def test_a_check_does_not_tell_how_to_resume_what_it_removes(
    tmp_path: Path, builtin_scene: Scene, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "mine.py"
    file.write_text(LEARNS_LAST.replace("self.best = 7", "raise ValueError('a bug')"))
    check = ControllerCheck(
        str(file), Condition.parse("OM"), builtin_scene, 1, {}, LOCAL, tests_a_goal=True
    )
    assert "a bug" in list(check.findings())[-1].detail
    assert "--resume" not in caplog.text


def test_every_fault_of_a_controller_gives_its_submission_a_status() -> None:
    kinds, named = [ControllerError], set()
    while kinds:
        kind = kinds.pop()
        named.add(kind.__name__)
        kinds += kind.__subclasses__()
    assert named <= STATUS_OF.keys()
